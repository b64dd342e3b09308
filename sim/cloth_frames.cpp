#include "sim/cloth_frames.h"

#include "sim/cloth_strain.h"

namespace drench::sim {

namespace {

/// Of a vertex here: as pins and seams of the shot number it.
std::vector<uint32_t> numbers_of(const Sheet& sheet) {
  std::vector<uint32_t> number(sheet.position.size());
  for (uint32_t v = 0; v < number.size(); ++v) number[v] = v;
  for (uint32_t v = 0; v < sheet.of_file.size(); ++v)
    if (sheet.of_file[v] >= 0) number[size_t(sheet.of_file[v])] = v;
  return number;
}

void add_strain(const Sheet& sheet, const std::vector<ClothStrain>& strain, TriangleMesh& mesh) {
  for (const int node : sheet.node) {
    const ClothStrain& at = strain[size_t(node)];
    mesh.strain_max.push_back(at.strain_max), mesh.strain_min.push_back(at.strain_min);
    mesh.stress_max.push_back(at.stress_max), mesh.stress_min.push_back(at.stress_min);
  }
}

ClothFrame frame_of(const Scene& scene, const Sheet& sheet, int first, const HostState& state) {
  const auto world = [&](int axis, const std::vector<float>& local, size_t v, double shift) {
    return float(scene.frame.to_world(axis, local[v]) + shift);
  };
  ClothFrame out{sheet.name, {}};
  const HostVec &x = state.cloth_position, &u = state.cloth_velocity;
  // Both edges at a seam are drawn, so that there is no hole in what is seen.
  for (size_t point = 0; point < sheet.position.size(); ++point) {
    const auto v = size_t(first + sheet.node[point]);
    const V3d shift = V3d(sheet.image[point]) * sheet.period;
    out.mesh.position.emplace_back(world(0, x.x, v, shift.x), world(1, x.y, v, shift.y),
                                   world(2, x.z, v, shift.z));
    out.mesh.velocity.emplace_back(u.x[v], u.y[v], u.z[v]);
    out.mesh.rest_position.push_back(V3f(sheet.rest[point]));
  }
  out.mesh.uv = sheet.uv;
  out.mesh.id = numbers_of(sheet);
  if (sheet.is_sewn()) out.mesh.point = sheet.welded;
  out.mesh.triangle = sheet.triangle;
  return out;
}

}  // namespace

std::vector<ClothFrame> cloth_frames(const Shot& shot, const Scene& scene, const HostState& state) {
  std::vector<ClothFrame> frames;
  for (size_t s = 0; s < scene.sheet.size(); ++s) {
    const int first = scene.first_vertex[s];
    frames.push_back(frame_of(scene, scene.sheet[s], first, state));
    if (!scene.cloth.wet.empty() && scene.cloth.wet[s].uptake > 0) {
      for (const int node : scene.sheet[s].node)
        frames.back().mesh.wetness.push_back(state.cloth_wetness[size_t(first + node)]);
    }
    if (!shot.cloth[s].write_strain) continue;
    const VertexRange vertices{first, scene.first_vertex[s + 1] - first};
    add_strain(scene.sheet[s], cloth_strain(scene.cloth, state, vertices), frames.back().mesh);
  }
  return frames;
}

}  // namespace drench::sim
