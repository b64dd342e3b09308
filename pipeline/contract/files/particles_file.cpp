#include "pipeline/contract/files/particles_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/point_file.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

constexpr float largest_half = 65504;

/// The columns of one number a particle, halves in the file unless a value is too large for one.
struct RealColumn {
  const char* name;
  std::vector<float> ParticleFrame::*values;
};
constexpr RealColumn real_columns[] = {{"density", &ParticleFrame::density},
                                       {"age", &ParticleFrame::age},
                                       {"wetness", &ParticleFrame::wetness}};

/// The name of a column whose value of particle i is not finite, or null.
const char* real_not_finite(const ParticleFrame& frame, size_t i) {
  for (const auto& [name, values] : real_columns)
    if (!(frame.*values).empty() && !std::isfinite((frame.*values)[i])) return name;
  return nullptr;
}

void check_frame(const fs::path& path, const ParticleFrame& frame) {
  const size_t n = frame.position.size();
  const auto fits = [&](const auto& column) { return column.empty() || column.size() == n; };
  if (frame.velocity.size() != n || !fits(frame.density) || !fits(frame.id) ||
      !fits(frame.source) || !fits(frame.age) || !fits(frame.wetness) || !(frame.spacing > 0)) {
    throw std::logic_error("write_particles: columns differ in length, or no spacing");
  }
  // Beyond this a voxel has no 32-bit coordinate.
  const float farthest = float(voxel_in_spacings * frame.spacing * (1 << 30));
  const auto beyond = [](const Imath::V3f& v, float limit) {
    return !(std::abs(v.x) <= limit && std::abs(v.y) <= limit && std::abs(v.z) <= limit);
  };
  for (size_t i = 0; i < n; ++i) {
    const char* const not_finite = real_not_finite(frame, i);
    if (beyond(frame.position[i], farthest) || beyond(frame.velocity[i], largest_half) ||
        not_finite) {
      const Imath::V3f &x = frame.position[i], &v = frame.velocity[i];
      throw Error(
          fmt::format("{}: particle {} has position [{}, {}, {}] m and velocity [{}, {}, {}] "
                      "m/s{}; the file was "
                      "not written. The simulation has blown up: use a smaller time step",
                      path.string(), i, x.x, x.y, x.z, v.x, v.y, v.z,
                      not_finite ? fmt::format(", whose {} is not finite", not_finite) : ""));
    }
  }
}

/// Halves, unless a value is too large for one.
Precision precision_of(const std::vector<float>& column) {
  const auto [least, most] = std::minmax_element(column.begin(), column.end());
  return std::max(-*least, *most) < largest_half ? Precision::half : Precision::full;
}

void sort_by_id(ParticleFrame& frame) {
  const std::vector<uint32_t> order = order_of_ids(frame.id);
  reorder(frame.position, order);
  reorder(frame.velocity, order);
  for (const auto& [name, values] : real_columns) reorder(frame.*values, order);
  reorder(frame.id, order);
  reorder(frame.source, order);
}

ParticleFrame frame_of(const PointReader& points) {
  if (!points.holds_points()) throw std::runtime_error("it holds no particles");
  ParticleFrame frame;
  frame.spacing = points.real("spacing");
  frame.rest_density = points.real("rest_density");
  const size_t count = points.count();
  auto [position, velocity] = points.motion();
  frame.position = std::move(position);
  frame.velocity = std::move(velocity);
  for (const auto& [name, values] : real_columns) frame.*values = points.column<float>(name);
  frame.id = points.column<uint32_t>("id");
  frame.source = points.column<uint8_t>("source");
  const auto fits = [&](const auto& column) { return column.empty() || column.size() == count; };
  bool whole = frame.position.size() == count && fits(frame.id) && fits(frame.source);
  for (const auto& [name, values] : real_columns) whole = whole && fits(frame.*values);
  if (!whole) throw std::runtime_error("some particles are missing");
  if (!frame.id.empty()) sort_by_id(frame);
  return frame;
}

}  // namespace

WrittenFile write_particles(const fs::path& path, const ParticleFrame& frame) {
  check_frame(path, frame);
  PointWriter points("particles", frame.position, frame.spacing);
  points.add("v", frame.velocity, Precision::half);
  for (const auto& [name, values] : real_columns) {
    const std::vector<float>& column = frame.*values;
    if (!column.empty()) points.add(name, column, precision_of(column));
  }
  if (!frame.id.empty()) points.add("id", frame.id);
  if (!frame.source.empty()) points.add("source", frame.source);
  points.set("rest_density", frame.rest_density);
  return points.write(path);
}

ParticleFrame read_particles(const fs::path& path) {
  ParticleFrame frame;
  read_point_file(path, "a particle cache", "the simulation will write it again",
                  [&](const PointReader& points) { frame = frame_of(points); });
  return frame;
}

}  // namespace drench
