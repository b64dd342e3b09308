#include "pipeline/driver/viewer/view_data.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>

#include "pipeline/driver/layout.h"
#include "pipeline/driver/rules.h"
#include "render/scene/camera.h"

namespace drench {

using Imath::V3d;
using Imath::V3f;
using nlohmann::json;

static_assert(std::endian::native == std::endian::little, "columns are sent as they lie");

namespace {

template <class T>
void put(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

struct Range {
  float low = std::numeric_limits<float>::max(), high = std::numeric_limits<float>::lowest();
  void add(float value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  /// 0 ... most of a value; 0 where all are one.
  template <class T>
  T share(float value) const {
    const float length = high - low;
    const float share = length > 0 ? std::clamp((value - low) / length, 0.f, 1.f) : 0.f;
    return T(std::lround(share * float(std::numeric_limits<T>::max())));
  }
};

/// Mixes the bits of an id, so that order by it is unlike any other (finalizer of MurmurHash3).
uint32_t mixed(uint32_t id) {
  id = (id ^ id >> 16) * 0x85ebca6bu;
  id = (id ^ id >> 13) * 0xc2b2ae35u;
  return id ^ id >> 16;
}

/// Particles in the order that is sent.
std::vector<uint32_t> order_of(const ParticleFrame& frame) {
  std::vector<uint32_t> order(frame.position.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto id = [&](uint32_t i) { return frame.id.empty() ? i : frame.id[i]; };
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    const uint32_t x = mixed(id(a)), y = mixed(id(b));
    return x != y ? x < y : a < b;
  });
  return order;
}

json vector_of(const V3d& v) { return {v.x, v.y, v.z}; }
json vector_of(const V3f& v) { return {v.x, v.y, v.z}; }

json camera_of(const Shot& shot, int frame) {
  const render::ShutterCamera camera(shot.camera, frame, frame, shot.render.width,
                                     shot.render.height);
  const render::CameraPose& pose = camera.open();
  return {{"position", vector_of(pose.position)},
          {"right", vector_of(pose.right)},
          {"up", vector_of(pose.up)},
          {"forward", vector_of(pose.forward)},
          {"half_width", pose.half_width}};
}

/// Largest stretch of an edge at each vertex, less 1; 0 without a rest shape.
std::vector<float> stretch_of(const TriangleMesh& mesh) {
  std::vector<float> stretch(mesh.position.size(), mesh.rest_position.empty() ? 0.f : -1.f);
  if (mesh.rest_position.empty()) return stretch;
  for (const auto& t : mesh.triangle)
    for (const auto& [a, b] : {std::pair{t.x, t.y}, std::pair{t.y, t.z}, std::pair{t.z, t.x}}) {
      const float rest = (mesh.rest_position[a] - mesh.rest_position[b]).length();
      if (rest <= 0) continue;
      const float value = (mesh.position[a] - mesh.position[b]).length() / rest - 1;
      stretch[a] = std::max(stretch[a], value);
      stretch[b] = std::max(stretch[b], value);
    }
  return stretch;
}

std::vector<V3f> normals_of(const TriangleMesh& mesh) {
  if (!mesh.normal.empty()) return mesh.normal;
  std::vector<V3f> normal(mesh.position.size(), V3f(0));
  for (const auto& t : mesh.triangle) {
    const V3f n =
        (mesh.position[t.y] - mesh.position[t.x]).cross(mesh.position[t.z] - mesh.position[t.x]);
    for (const uint32_t k : {t.x, t.y, t.z}) normal[k] += n;
  }
  for (V3f& n : normal) n.normalize();
  return normal;
}

}  // namespace

std::string view_scene(const Job& job, const Manifest& manifest) {
  const Shot& shot = job.shot;
  json frames = json::array(), probes = json::array();
  for (const int frame : job.targets.frames) {
    json sheets = json::array();
    for (const std::string& name : job.targets.cloth)
      sheets.push_back(manifest.find(layout::cloth(name, frame)).has_value());
    frames.push_back({{"frame", frame},
                      {"particles", manifest.find(layout::particles(frame)).has_value()},
                      {"fluid", manifest.find(layout::fluid_mesh(frame)).has_value()},
                      {"sheets", sheets},
                      {"camera", camera_of(shot, frame)}});
  }
  for (const Probe& probe : shot.probe)
    probes.push_back({{"name", probe.name}, {"position", vector_of(probe.position)}});
  const json scene{{"shot", shot.name},
                   {"fps", shot.timeline.fps},
                   {"spacing", shot.fluid.spacing},
                   {"low", vector_of(shot.domain.min)},
                   {"high", vector_of(shot.domain.max)},
                   {"aspect", double(shot.render.width) / shot.render.height},
                   {"cloth", job.targets.cloth},
                   {"probes", probes},
                   {"frames", frames}};
  return scene.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string view_particles(const ParticleFrame& frame, size_t most) {
  std::array<Range, 3> box;
  Range speed, density, age;
  for (size_t i = 0; i < frame.position.size(); ++i) {
    for (int c = 0; c < 3; ++c) box[size_t(c)].add(frame.position[i][c]);
    speed.add(frame.velocity[i].length());
    if (!frame.density.empty()) density.add(frame.density[i]);
    if (!frame.age.empty()) age.add(frame.age[i]);
  }
  const size_t count = std::min(most, frame.position.size());
  std::string bytes;
  bytes.reserve(64 + 10 * count);
  put(bytes, uint32_t(1));
  put(bytes, uint32_t(frame.position.size()));
  put(bytes, uint32_t(count));
  for (const Range& axis : box) put(bytes, count ? axis.low : 0.f);
  for (const Range& axis : box) put(bytes, count ? axis.high - axis.low : 0.f);
  speed.low = 0;
  age.low = 0;
  put(bytes, count ? speed.high : 0.f);
  put(bytes, frame.density.empty() || !count ? 0.f : density.low);
  put(bytes, frame.density.empty() || !count ? 0.f : density.high);
  put(bytes, frame.age.empty() || !count ? 0.f : age.high);
  const std::vector<uint32_t> order = order_of(frame);
  for (size_t k = 0; k < count; ++k) {
    const uint32_t i = order[k];
    for (int c = 0; c < 3; ++c) put(bytes, box[size_t(c)].share<uint16_t>(frame.position[i][c]));
    put(bytes, speed.share<uint8_t>(frame.velocity[i].length()));
    put(bytes, frame.density.empty() ? uint8_t(0) : density.share<uint8_t>(frame.density[i]));
    put(bytes, frame.age.empty() ? uint8_t(0) : age.share<uint8_t>(frame.age[i]));
    put(bytes, uint8_t(0));
  }
  return bytes;
}

std::string view_mesh(const TriangleMesh& mesh, ViewMesh kind) {
  std::string bytes;
  bytes.reserve(16 + 24 * mesh.position.size() + 12 * mesh.triangle.size());
  put(bytes, uint32_t(2));
  put(bytes, uint32_t(mesh.position.size()));
  put(bytes, uint32_t(mesh.triangle.size()));
  put(bytes, uint32_t(2));
  for (const V3f& p : mesh.position) put(bytes, p);
  for (const V3f& n : normals_of(mesh))
    for (const float c : {n.x, n.y, n.z, 0.f})
      put(bytes, int8_t(std::lround(127 * std::clamp(c, -1.f, 1.f))));
  const std::vector<float> stretch =
      kind == ViewMesh::sheet ? stretch_of(mesh) : std::vector<float>();
  for (size_t i = 0; i < mesh.position.size(); ++i) {
    const bool sheet = kind == ViewMesh::sheet;
    put(bytes, sheet ? stretch[i] : mesh.velocity.empty() ? 0.f : mesh.velocity[i].length());
    put(bytes, sheet && !mesh.wetness.empty() ? mesh.wetness[i] : 0.f);
  }
  for (const auto& t : mesh.triangle) put(bytes, t);
  return bytes;
}

}  // namespace drench
