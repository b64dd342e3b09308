#include "sim/setup/sewing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/setup/scene.h"

namespace drench::sim {

namespace {

/// N/m, of a sheet along itself.
double modulus_of(const Cloth& cloth) {
  return cloth.model == ClothModel::shell ? std::max(cloth.young_warp, cloth.young_weft)
                                          : cloth.adjacent_stiffness + cloth.diagonal_stiffness;
}

size_t sheet_named(const Shot& shot, const std::string& name, size_t own) {
  for (size_t s = 0; s < shot.cloth.size() && !name.empty(); ++s)
    if (shot.cloth[s].name == name) return s;
  return own;
}

V3d start_of(const Scene& scene, int vertex) {
  const HostVec& x = scene.start.cloth_position;
  return {x.x[size_t(vertex)], x.y[size_t(vertex)], x.z[size_t(vertex)]};
}

/// Pairs of vertices of the sheets, all in one.
struct Pairs {
  std::vector<int> a, b;

  double squares(const Scene& scene) const {
    double sum = 0;
    for (size_t k = 0; k < a.size(); ++k)
      sum += (start_of(scene, a[k]) - start_of(scene, b[k])).length2();
    return sum;
  }
};

Pairs pairs_of(const Shot& shot, const Scene& scene, size_t s, size_t index) {
  const ClothSeam& seam = shot.cloth[s].seam[index];
  const size_t other = sheet_named(shot, seam.to, s);
  const std::string key = fmt::format("seam {}", index + 1);
  Pairs pairs{nodes_of_seam(shot.cloth[s], scene.sheet[s], key, seam.edge, seam.vertices),
              nodes_of_seam(shot.cloth[other], scene.sheet[other],
                            fmt::format("{} of cloth \"{}\"", key, shot.cloth[s].name),
                            seam.to_edge, seam.to_vertices)};
  for (int& v : pairs.a) v += scene.first_vertex[s];
  for (int& v : pairs.b) v += scene.first_vertex[other];
  if (seam.edge == GridEdge::none || seam.to_edge == GridEdge::none) return pairs;
  Pairs turned = pairs;
  std::reverse(turned.b.begin(), turned.b.end());
  return turned.squares(scene) < pairs.squares(scene) ? turned : pairs;
}

}  // namespace

Sewing::Sewing(const Shot& shot, Scene& scene) : begin_(-shot.preroll) {
  for (size_t s = 0; s < shot.cloth.size(); ++s) {
    const Cloth& cloth = shot.cloth[s];
    for (size_t k = 0; k < cloth.seam.size(); ++k) {
      const ClothSeam& seam = cloth.seam[k];
      const Cloth& other = shot.cloth[sheet_named(shot, seam.to, s)];
      const double rest = seam.rest_length < 0 ? 0.5 * (cloth.thickness + other.thickness)
                                               : seam.rest_length,
                   stiffness = seam.stiffness > 0
                                   ? seam.stiffness
                                   : 10 * std::max(modulus_of(cloth), modulus_of(other));
      const Pairs pairs = pairs_of(shot, scene, s, k);
      double widest = 0;
      for (size_t i = 0; i < pairs.a.size(); ++i) {
        const int a = pairs.a[i], b = pairs.b[i];
        if (a == b) continue;  // one point of the sheet already
        const double start = (start_of(scene, b) - start_of(scene, a)).length();
        scene.cloth.seam.push_back({a, b, float(rest), float(stiffness)});
        spring_.push_back({start, rest, seam.time});
        widest = std::max(widest, start - rest);
      }
      if (seam.time > 0) end_ = std::max(end_, begin_ + seam.time);
      if (seam.time > 0 || widest < std::max(10 * rest, 0.5 * shot.fluid.spacing)) continue;
      scene.report.notes.push_back(fmt::format(
          "cloth \"{}\": seam {} starts up to {:.3g} m open and closes at once, which throws the "
          "sheets. Give it a time, s, in which it is drawn together, or move the sheets",
          cloth.name, k + 1, widest));
    }
  }
}

std::vector<float> Sewing::lengths(double time) const {
  std::vector<float> all;
  for (const Drawn& d : spring_) {
    const double left = d.time > 0 ? std::clamp(1 - (time - begin_) / d.time, 0., 1.) : 0;
    all.push_back(float(d.rest + (d.start - d.rest) * left));
  }
  return all;
}

}  // namespace drench::sim
