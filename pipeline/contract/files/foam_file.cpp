#include "pipeline/contract/files/foam_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/point_file.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

void check_frame(const fs::path& path, const FoamFrame& frame) {
  const size_t n = frame.position.size();
  for (const size_t column : {frame.velocity.size(), frame.id.size(), frame.age.size(),
                              frame.radius.size(), frame.kind.size()})
    if (column != n) throw std::logic_error("write_foam: columns differ in length");
  if (!(frame.spacing > 0)) throw std::logic_error("write_foam: no spacing");
  const float farthest = float(voxel_in_spacings * frame.spacing * (1 << 30));
  for (size_t i = 0; i < n; ++i) {
    const Imath::V3f &x = frame.position[i], &v = frame.velocity[i];
    const bool near =
        std::abs(x.x) <= farthest && std::abs(x.y) <= farthest && std::abs(x.z) <= farthest;
    if (near && std::isfinite(v.x + v.y + v.z)) continue;
    throw Error(
        fmt::format("{}: foam particle {} has position [{}, {}, {}] m and velocity [{}, {}, {}] "
                    "m/s; the file was not written. The fluid's velocities are damaged or blew up: "
                    "simulate with a smaller time step",
                    path.string(), frame.id[i], x.x, x.y, x.z, v.x, v.y, v.z));
  }
}

FoamFrame frame_of(const PointReader& points) {
  if (!points.holds_points() || points.name() != "foam")
    throw std::runtime_error("it holds no foam");
  FoamFrame frame;
  frame.spacing = points.real("spacing");
  frame.next_id = uint32_t(points.integer("next_id"));
  const size_t count = points.count();
  auto [position, velocity] = points.motion();
  frame.position = std::move(position);
  frame.velocity = std::move(velocity);
  frame.id = points.column<uint32_t>("id");
  frame.age = points.column<float>("age");
  frame.radius = points.column<float>("pscale");
  frame.kind = points.column<FoamKind>("kind");
  for (const size_t rows : {frame.position.size(), frame.id.size(), frame.age.size(),
                            frame.radius.size(), frame.kind.size()})
    if (rows != count) throw std::runtime_error("some particles are missing");
  if (std::any_of(frame.kind.begin(), frame.kind.end(),
                  [](FoamKind kind) { return kind > FoamKind::bubble; }))
    throw std::runtime_error("a particle is neither spray nor foam nor a bubble");
  const std::vector<uint32_t> order = order_of_ids(frame.id);
  reorder(frame.position, order);
  reorder(frame.velocity, order);
  reorder(frame.age, order);
  reorder(frame.radius, order);
  reorder(frame.kind, order);
  reorder(frame.id, order);
  return frame;
}

}  // namespace

WrittenFile write_foam(const fs::path& path, const FoamFrame& frame) {
  check_frame(path, frame);
  PointWriter points("foam", frame.position, frame.spacing);
  points.add("v", frame.velocity, Precision::full);
  points.add("id", frame.id);
  points.add("age", frame.age, Precision::full);
  points.add("pscale", frame.radius, Precision::full);
  points.add("kind", frame.kind);
  points.set("next_id", int64_t(frame.next_id));
  return points.write(path);
}

FoamFrame read_foam(const fs::path& path) {
  FoamFrame frame;
  read_point_file(path, "a foam cache",
                  "the run makes it again, and the frames after it if it comes out different",
                  [&](const PointReader& points) { frame = frame_of(points); });
  return frame;
}

}  // namespace drench
