// Sheets: grids and meshes with masses and springs (section 4 of the seed), and the checks they
// must pass.

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/geometry/weld.h"
#include "pipeline/contract/log.h"
#include "pipeline/contract/shot/pin_check.h"
#include "sim/setup/scene.h"

namespace drench::sim {

namespace {

using Edge = std::pair<uint32_t, uint32_t>;
Edge ordered(uint32_t a, uint32_t b) { return a < b ? Edge{a, b} : Edge{b, a}; }

/// Springs between the same two nodes add up.
struct SpringMap {
  const Sheet& sheet;
  std::map<std::pair<Edge, std::array<int, 3>>, double> stiffness;

  /// @param image  periods that are added to where b is
  void add(uint32_t a, uint32_t b, double k, Imath::V3i image = Imath::V3i(0)) {
    auto from = uint32_t(sheet.node[a]), to = uint32_t(sheet.node[b]);
    image += sheet.image[b] - sheet.image[a];
    if (from > to) std::swap(from, to), image = -image;
    stiffness[{{from, to}, {image.x, image.y, image.z}}] += k;
  }
};

uint32_t at(const Cloth& cloth, int i, int j) { return uint32_t(j * (cloth.cells.x + 1) + i); }

void build_grid(const Cloth& cloth, Sheet& sheet) {
  const int nu = cloth.cells.x, nv = cloth.cells.y;
  for (int j = 0; j <= nv; ++j) {
    for (int i = 0; i <= nu; ++i) {
      const double s = double(i) / nu, t = double(j) / nv;
      sheet.position.push_back(cloth.corner + cloth.u * s + cloth.v * t);
      sheet.uv.push_back(Imath::V2f(float(s), float(t)));
    }
  }
  for (int j = 0; j < nv; ++j) {
    for (int i = 0; i < nu; ++i) {
      const uint32_t a = at(cloth, i, j), b = at(cloth, i + 1, j), c = at(cloth, i + 1, j + 1),
                     d = at(cloth, i, j + 1);
      // v x u points to the front, so a sheet in x, z faces up.
      sheet.triangle.push_back({a, d, c});
      sheet.triangle.push_back({a, c, b});
    }
  }
}

/// Every cell of a grid gives its four sides half an adjacent spring each, stiffer across and
/// softer along a stretched cell (k = modulus x width / length), both its diagonals, and a quarter
/// of its mass to each corner: the lattice's moduli then hold up to the rim
/// (tests/validation/README.md).
void fill_grid(const Cloth& cloth, Sheet& sheet, SpringMap& springs) {
  const int nu = cloth.cells.x, nv = cloth.cells.y;
  const double du = cloth.u.length() / nu, dv = cloth.v.length() / nv;
  const double mass = cloth.areal_density * cloth.u.cross(cloth.v).length() / (double(nu) * nv);
  for (int j = 0; j < nv; ++j) {
    for (int i = 0; i < nu; ++i) {
      const uint32_t a = at(cloth, i, j), b = at(cloth, i + 1, j), c = at(cloth, i + 1, j + 1),
                     d = at(cloth, i, j + 1);
      for (uint32_t v : {a, b, c, d}) sheet.mass[size_t(sheet.node[v])] += mass / 4;
      springs.add(a, b, 0.5 * cloth.adjacent_stiffness * dv / du);
      springs.add(d, c, 0.5 * cloth.adjacent_stiffness * dv / du);
      springs.add(a, d, 0.5 * cloth.adjacent_stiffness * du / dv);
      springs.add(b, c, 0.5 * cloth.adjacent_stiffness * du / dv);
      springs.add(a, c, cloth.diagonal_stiffness);
      springs.add(b, d, cloth.diagonal_stiffness);
    }
  }
}

/// Whether two corners of a triangle are one: it encloses nothing.
bool is_collapsed(const Imath::Vec3<uint32_t>& t, const std::vector<uint32_t>& welded) {
  return welded[t.x] == welded[t.y] || welded[t.y] == welded[t.z] || welded[t.z] == welded[t.x];
}

/// Keeps the vertices that triangles use, in their order.
void keep_used(const TriangleMesh& mesh, const std::vector<uint32_t>& welded, Sheet& sheet) {
  const size_t n = mesh.position.size();
  std::vector<char> used(n, 0);
  for (const auto& t : mesh.triangle) {
    if (is_collapsed(t, welded)) continue;
    for (const uint32_t v : {t.x, t.y, t.z}) used[v] = used[welded[v]] = 1;
    sheet.triangle.push_back(t);
  }
  sheet.of_file.assign(n, -1);
  for (size_t v = 0; v < n; ++v) {
    if (!used[v]) continue;
    sheet.of_file[v] = int(sheet.position.size());
    sheet.position.push_back(V3d(mesh.position[v]));
    if (!mesh.uv.empty()) sheet.uv.push_back(mesh.uv[v]);
  }
  for (auto& t : sheet.triangle)
    for (int c = 0; c < 3; ++c) t[c] = uint32_t(sheet.of_file[t[c]]);
  for (size_t v = 0; v < n; ++v)
    if (used[v]) sheet.welded.push_back(uint32_t(sheet.of_file[welded[v]]));
}

void say_what_was_mended(const TriangleMesh& mesh, const Welded& welded, const Sheet& sheet) {
  const auto say = [&](const std::string& text) {
    log_warning("sim", fmt::format("cloth \"{}\": {}", sheet.name, text));
  };
  if (welded.count > 0) {
    say(fmt::format(
        "{} vertices on free edges stand within {:.3g} m of another and are sewn to it, "
        "as exporters split them at seams of the texture; cloth.weld = 0 keeps them "
        "apart",
        welded.count, welded.widest));
  }
  if (const size_t collapsed = mesh.triangle.size() - sheet.triangle.size(); collapsed > 0)
    say(fmt::format("{} triangles with two corners at one point were left out", collapsed));
  const auto stray = std::find(sheet.of_file.begin(), sheet.of_file.end(), -1);
  if (stray == sheet.of_file.end()) return;
  const auto first = size_t(stray - sheet.of_file.begin());
  const V3f& p = mesh.position[first];
  say(
      fmt::format("{} vertices belong to no triangle and were left out; the first is vertex {} at "
                  "({:.6g}, {:.6g}, {:.6g}) m",
                  std::count(stray, sheet.of_file.end(), -1), first, p.x, p.y, p.z));
}

void build_from_file(const Cloth& cloth, Sheet& sheet) {
  const TriangleMesh mesh = read_mesh(cloth.mesh_file, CornerData::uv);
  const Welded welded = weld(mesh, cloth.weld < 0 ? weld_fraction * diagonal_of(mesh) : cloth.weld);
  keep_used(mesh, welded.first, sheet);
  say_what_was_mended(mesh, welded, sheet);
}

/// Every triangle gives a third of its mass to each corner.
void weigh_thirds(const Cloth& cloth, Sheet& sheet) {
  for (const auto& t : sheet.triangle) {
    const V3d e = sheet.position[t.y] - sheet.position[t.x],
              f = sheet.position[t.z] - sheet.position[t.x];
    for (int k = 0; k < 3; ++k)
      sheet.mass[size_t(sheet.node[t[k]])] += cloth.areal_density * e.cross(f).length() / 6;
  }
}

/// Edges of triangles are adjacent springs, the two vertices opposite an edge a diagonal one.
void fill_mesh(const Cloth& cloth, Sheet& sheet, SpringMap& springs) {
  struct Tip {
    uint32_t vertex, beside;  // one end of the edge, the same node from both sides
  };
  std::map<Edge, std::vector<Tip>> opposite;
  weigh_thirds(cloth, sheet);
  for (const auto& t : sheet.triangle) {
    for (int k = 0; k < 3; ++k) {
      const uint32_t a = t[k], b = t[(k + 1) % 3];
      springs.add(a, b, 0.5 * cloth.adjacent_stiffness);
      const auto na = uint32_t(sheet.node[a]), nb = uint32_t(sheet.node[b]);
      opposite[ordered(na, nb)].push_back({t[(k + 2) % 3], na < nb ? a : b});
    }
  }
  for (const auto& [edge, tips] : opposite) {
    if (tips.size() != 2) continue;
    springs.add(tips[0].vertex, tips[1].vertex, cloth.diagonal_stiffness,
                sheet.image[tips[0].beside] - sheet.image[tips[1].beside]);
  }
}

std::string corner_text(const Sheet& sheet, const Imath::Vec3<uint32_t>& t) {
  const V3d p = sheet.position[t.x];
  return fmt::format("vertices {}, {}, {} near ({:.4g}, {:.4g}, {:.4g}) m", t.x, t.y, t.z, p.x, p.y,
                     p.z);
}

void check_triangles(const Sheet& sheet) {
  std::map<std::pair<uint32_t, uint32_t>, size_t> directed;
  for (size_t k = 0; k < sheet.triangle.size(); ++k) {
    const auto& t = sheet.triangle[k];
    const V3d e = sheet.position[t.y] - sheet.position[t.x],
              f = sheet.position[t.z] - sheet.position[t.x];
    const double longest = std::max({e.length2(), f.length2(), (f - e).length2()});
    if (!(e.cross(f).length() > 1e-6 * longest)) {
      throw Error(fmt::format(
          "cloth \"{}\": triangle {} ({}) is degenerate: it has no area, so contact has no "
          "normal there. Remove it or merge its vertices",
          sheet.name, k, corner_text(sheet, t)));
    }
    for (int c = 0; c < 3; ++c) {
      const uint32_t a = sheet.welded[t[c]], b = sheet.welded[t[(c + 1) % 3]];
      const auto [place, fresh] = directed.emplace(std::pair(a, b), k);
      if (fresh) continue;
      const bool sewn = a != t[c] || b != t[(c + 1) % 3];
      throw Error(fmt::format(
          "cloth \"{}\": triangle {} ({}) shares the edge {}-{} with triangle {} in the same "
          "direction: the mesh is not manifold, or is wound both ways. Split the sheet "
          "there or reverse the triangle{}",
          sheet.name, k, corner_text(sheet, t), a, b, place->second,
          sewn ? "; its vertices were sewn to others at their place, which cloth.weld = 0 does not"
               : ""));
    }
  }
}

/// The vertex of the sheet that the shot gives by number; -1: the file's is left out.
/// @param key  "pin 2", "seam 1"
int vertex_here(const Sheet& sheet, const std::string& key, uint32_t v) {
  const size_t vertices = sheet.of_file.empty() ? sheet.position.size() : sheet.of_file.size();
  if (v >= vertices) {
    throw Error(
        fmt::format("cloth \"{}\": {} names vertex {}, but there are {} vertices, counted from 0",
                    sheet.name, key, v, vertices));
  }
  return sheet.of_file.empty() ? int(v) : sheet.of_file[v];
}

/// Rising.
std::vector<int> nodes_of_pin(const Sheet& sheet, const ClothPin& pin, size_t index) {
  std::set<int> nodes;
  for (const uint32_t v : pin.vertices) {
    const int here = vertex_here(sheet, fmt::format("pin {}", index + 1), v);
    if (here >= 0) nodes.insert(sheet.node[size_t(here)]);
  }
  for (size_t v = 0; pin.box && v < sheet.position.size(); ++v) {
    const auto& [low, high] = *pin.box;
    const V3d& p = sheet.position[v];
    if (p.x >= low.x && p.y >= low.y && p.z >= low.z && p.x <= high.x && p.y <= high.y &&
        p.z <= high.z)
      nodes.insert(sheet.node[v]);
  }
  if (nodes.empty()) {
    throw Error(fmt::format("cloth \"{}\": pin {} holds no vertex. Enlarge its box or remove it",
                            sheet.name, index + 1));
  }
  return {nodes.begin(), nodes.end()};
}

void apply_pins(const Cloth& cloth, Sheet& sheet) {
  sheet.pinned.assign(sheet.point.size(), false);
  sheet.held.assign(sheet.point.size(), false);
  std::vector<int> first(sheet.point.size(), -1);
  for (size_t k = 0; k < cloth.pin.size(); ++k) {
    const ClothPin& pin = cloth.pin[k];
    sheet.group.push_back(nodes_of_pin(sheet, pin, k));
    for (const int node : sheet.group.back()) {
      const auto at = size_t(node);
      if (first[at] >= 0 && !(pin.stands() && cloth.pin[size_t(first[at])].stands())) {
        throw Error(fmt::format(
            "cloth \"{}\": pins {} and {} both hold vertex {}, and one of them does more than hold "
            "it where it starts. Let each vertex have one pin",
            sheet.name, first[at] + 1, k + 1, sheet.point[at]));
      }
      first[at] = int(k);
      if (pin.stiffness == 0) sheet.pinned[at] = true;
      if (pin.stiffness == 0 && !pin.lets_go()) sheet.held[at] = true;
    }
  }
}

}  // namespace

std::vector<int> nodes_of_seam(const Cloth& cloth, const Sheet& sheet, const std::string& key,
                               GridEdge edge, const std::vector<uint32_t>& list) {
  std::vector<int> nodes;
  for (const uint32_t v : edge == GridEdge::none ? list : edge_vertices(edge, cloth.cells)) {
    const int here = vertex_here(sheet, key, v);
    if (here < 0) {
      throw Error(
          fmt::format("cloth \"{}\": {} sews vertex {}, which belongs to no triangle. Remove "
                      "it from the list",
                      sheet.name, key, v));
    }
    nodes.push_back(sheet.node[size_t(here)]);
  }
  return nodes;
}

Sheet build_sheet(const Cloth& cloth, const Seams& seams) {
  Sheet sheet;
  sheet.name = cloth.name;
  const bool grid = cloth.mesh_file.empty();
  grid ? build_grid(cloth, sheet) : build_from_file(cloth, sheet);
  if (sheet.triangle.empty())
    throw Error("cloth \"" + sheet.name + "\": the mesh has no triangles");
  if (grid) {
    sheet.welded.resize(sheet.position.size());
    std::iota(sheet.welded.begin(), sheet.welded.end(), 0u);
  }
  check_triangles(sheet);
  sheet.rest = sheet.position;
  join_at_seams(sheet, seams);
  sheet.mass.assign(sheet.point.size(), 0.0);
  SpringMap springs{sheet, {}};
  if (cloth.model == ClothModel::shell) {
    weigh_thirds(cloth, sheet);
  } else {
    grid ? fill_grid(cloth, sheet, springs) : fill_mesh(cloth, sheet, springs);
  }
  for (const auto& [ends, k] : springs.stiffness) {
    const auto& [edge, image] = ends;
    const Imath::V3i periods(image[0], image[1], image[2]);
    if (k > 0) sheet.spring.push_back({int(edge.first), int(edge.second), periods, k});
  }
  apply_pins(cloth, sheet);
  return sheet;
}

}  // namespace drench::sim
