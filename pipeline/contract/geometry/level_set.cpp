#include "pipeline/contract/geometry/level_set.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <stdexcept>

#include "pipeline/contract/error.h"
#include "pipeline/contract/frames.h"
#include "pipeline/contract/geometry/bounds.h"
#include "pipeline/contract/geometry/mesh_to_volume.h"
#include "pipeline/contract/geometry/shells.h"
#include "pipeline/contract/geometry/triangle.h"

namespace drench {

namespace {

using Imath::V3d, Imath::V3f;
using openvdb::FloatGrid;

Bounds bounds_of(const TriangleMesh& mesh) {
  Bounds bounds;
  for (const V3f& p : mesh.position) bounds.add(V3d(p));
  return bounds;
}

double blocks_of(const LevelSet& set) {
  return double(set.blocks[0]) * set.blocks[1] * set.blocks[2];
}

/// Blocks that a box of voxels touches, and a rim so that a sample beside them finds a block.
void frame_blocks(const openvdb::CoordBBox& box, LevelSet& set) {
  for (int k = 0; k < 3; ++k) {
    set.low[k] = int(std::floor(double(box.min()[k]) / LevelSet::side)) - 1;
    set.blocks[k] = int(std::floor(double(box.max()[k]) / LevelSet::side)) + 2 - set.low[k];
  }
  if (blocks_of(set) > 1e9) {
    throw Error(
        fmt::format("the mesh spans {} x {} x {} blocks of {} voxels of {:.4g} m; "
                    "use a larger fluid.spacing or a smaller mesh",
                    set.blocks[0], set.blocks[1], set.blocks[2], LevelSet::side, set.voxel));
  }
}

/// Voxels of the band around what a mesh has within bounds.
openvdb::CoordBBox voxels_of(const Bounds& mesh, const LevelSetBounds& bounds, double voxel,
                             double band) {
  openvdb::Coord low, high;
  for (int k = 0; k < 3; ++k) {
    // Bounds that the mesh does not meet have one block, which is outside.
    const double begin = std::max(mesh.low[k] - band, bounds.low[k]);
    const double end = std::max(begin, std::min(mesh.high[k] + band, bounds.high[k]));
    low[k] = int(std::clamp(std::floor(begin / voxel), -1e9, 1e9));
    high[k] = int(std::clamp(std::ceil(end / voxel), -1e9, 1e9));
  }
  return {low, high};
}

/// Within this of a triangle distances are exact, voxels. OpenVDB takes the nearest of the
/// triangles that it passes from voxel to voxel: up to 0.2 voxels too far on a fine sphere, one
/// below.
constexpr double refined = 2;

struct Span {
  openvdb::Coord low, high;  // voxels, inclusive
};
Span span_of(const TriangleMesh& mesh, uint32_t triangle, double voxel) {
  Span span;
  const auto& t = mesh.triangle[triangle];
  for (int k = 0; k < 3; ++k) {
    const double a = mesh.position[t.x][k], b = mesh.position[t.y][k], c = mesh.position[t.z][k];
    span.low[k] = int(std::ceil(std::min({a, b, c}) / voxel - refined));
    span.high[k] = int(std::floor(std::max({a, b, c}) / voxel + refined));
  }
  return span;
}

/// Triangles that may be within `refined` of a block's corners, in order.
std::vector<std::vector<uint32_t>> triangles_by_block(const TriangleMesh& mesh,
                                                      const LevelSet& set) {
  std::vector<std::vector<uint32_t>> near(set.block.size());
  const auto block = [&](int voxel, int k) {
    const int b = int(std::floor(double(voxel) / LevelSet::side)) - set.low[k];
    return std::clamp(b, 0, set.blocks[k] - 1);
  };
  for (uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    const Span span = span_of(mesh, t, set.voxel);
    // The lower corners of a block are the upper ones of the block before.
    for (int z = block(span.low[2] - 1, 2); z <= block(span.high[2], 2); ++z) {
      for (int y = block(span.low[1] - 1, 1); y <= block(span.high[1], 1); ++y) {
        for (int x = block(span.low[0] - 1, 0); x <= block(span.high[0], 0); ++x)
          near[size_t((z * set.blocks[1] + y) * set.blocks[0] + x)].push_back(t);
      }
    }
  }
  return near;
}

/// Exact distances to one triangle where they are less; the sign stays.
void refine(const TriangleMesh& mesh, uint32_t triangle, const openvdb::Coord& low, float voxel,
            float* value) {
  Span span = span_of(mesh, triangle, voxel);
  for (int k = 0; k < 3; ++k) {
    span.low[k] = std::max(span.low[k] - low[k], 0);
    span.high[k] = std::min(span.high[k] - low[k], LevelSet::side);
  }
  const auto& t = mesh.triangle[triangle];
  const Imath::V3f &a = mesh.position[t.x], &b = mesh.position[t.y], &c = mesh.position[t.z];
  for (int z = span.low[2]; z <= span.high[2]; ++z) {
    for (int y = span.low[1]; y <= span.high[1]; ++y) {
      for (int x = span.low[0]; x <= span.high[0]; ++x) {
        const Imath::V3f p(float(low[0] + x) * voxel, float(low[1] + y) * voxel,
                           float(low[2] + z) * voxel);
        float& d = value[(z * 9 + y) * 9 + x];
        const float exact = (p - closest_on_triangle(p, a, b, c)).length();
        if (exact < std::abs(d)) d = std::copysign(exact, d);
      }
    }
  }
}

/// Lower corner of block b, voxels.
openvdb::Coord origin_of(const LevelSet& set, int b) {
  constexpr int side = LevelSet::side;
  return openvdb::Coord(side * (set.low[0] + b % set.blocks[0]),
                        side * (set.low[1] + b / set.blocks[0] % set.blocks[1]),
                        side * (set.low[2] + b / set.blocks[0] / set.blocks[1]));
}

/// Values of the blocks of which any corner lies in the band; of the others where they are.
void take_values(const FloatGrid& grid, const TriangleMesh& mesh, LevelSet& set) {
  const int total = set.blocks[0] * set.blocks[1] * set.blocks[2];
  set.block.assign(size_t(total), LevelSet::outside);
  std::vector<char> wanted(size_t(total), 0);
  ::tbb::parallel_for(0, total, [&](int b) {
    auto at = grid.getConstAccessor();
    const openvdb::Coord low = origin_of(set, b);
    for (int k = 0; k < LevelSet::corners && !wanted[size_t(b)]; ++k)
      wanted[size_t(b)] = at.isValueOn(low + openvdb::Coord(k % 9, k / 9 % 9, k / 81));
    if (!wanted[size_t(b)] && at.getValue(low) < 0) set.block[size_t(b)] = LevelSet::inside;
  });
  int count = 0;
  for (int b = 0; b < total; ++b)
    if (wanted[size_t(b)]) set.block[size_t(b)] = count++;
  set.value.resize(size_t(count) * LevelSet::corners);
  const std::vector<std::vector<uint32_t>> near = triangles_by_block(mesh, set);
  ::tbb::parallel_for(0, total, [&](int b) {
    if (set.block[size_t(b)] < 0) return;
    auto at = grid.getConstAccessor();
    const openvdb::Coord low = origin_of(set, b);
    float* to = set.value.data() + size_t(set.block[size_t(b)]) * LevelSet::corners;
    for (int k = 0; k < LevelSet::corners; ++k) {
      const float d = at.getValue(low + openvdb::Coord(k % 9, k / 9 % 9, k / 81));
      to[k] = std::clamp(d, -set.band, set.band);
    }
    for (const uint32_t t : near[size_t(b)]) refine(mesh, t, low, set.voxel, to);
  });
}

/// Which corners of one layer of blocks are inside, by rays along x.
class LayerSigns {
 public:
  LayerSigns(const LevelSet& set, int layer, const TriangleMesh& mesh, const Shells& shells,
             const std::vector<uint32_t>& triangles)
      : nx_(LevelSet::side * set.blocks[0] + 1),
        ny_(LevelSet::side * set.blocks[1] + 1),
        inside_(size_t(nx_) * size_t(ny_) * 9, 0) {
    ShellRays::Grid grid;
    const double voxel = double(set.voxel);
    grid.low[0] = LevelSet::side * set.low[1] * voxel;
    grid.low[1] = LevelSet::side * (set.low[2] + layer) * voxel;
    grid.step[0] = grid.step[1] = voxel, grid.count[0] = ny_, grid.count[1] = 9;
    const ShellRays rays(mesh, shells.shell, triangles, grid);
    BodyCount count(shells);
    for (int z = 0; z < 9; ++z) {
      for (int y = 0; y < ny_; ++y) {
        char* row = inside_.data() + (size_t(z) * size_t(ny_) + size_t(y)) * size_t(nx_);
        int at = 0;
        for (const auto* c = rays.begin(y, z); c != rays.end(y, z); ++c) {
          const double corner = std::floor(c->x / voxel) + 1 - LevelSet::side * set.low[0];
          const int next = int(std::clamp(corner, double(at), double(nx_)));
          std::fill(row + at, row + next, char(count.inside()));
          at = next;
          count.pass(*c);
        }
      }
    }
  }
  /// Corner k of the block in column (x, y) of the layer.
  bool inside(int x, int y, int k) const {
    const size_t row = size_t(k / 81) * size_t(ny_) + size_t(LevelSet::side * y + k / 9 % 9);
    return inside_[row * size_t(nx_) + size_t(LevelSet::side * x + k % 9)] != 0;
  }

 private:
  int nx_, ny_;
  std::vector<char> inside_;
};

/// Calls visit(block, corner -> inside) for every block.
template <class Visit>
void for_each_sign(const LevelSet& set, const TriangleMesh& mesh, const Shells& shells,
                   const Visit& visit) {
  const int bx = set.blocks[0], by = set.blocks[1], bz = set.blocks[2];
  std::vector<std::vector<uint32_t>> by_layer(size_t(bz), std::vector<uint32_t>{});
  const double length = LevelSet::side * double(set.voxel);
  for (uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    const auto& c = mesh.triangle[t];
    const double a = mesh.position[c.x].z, b = mesh.position[c.y].z, d = mesh.position[c.z].z;
    const double low = std::floor(std::min({a, b, d}) / length) - set.low[2] - 1;
    const double high = std::floor(std::max({a, b, d}) / length) - set.low[2];
    for (int z = int(std::clamp(low, 0., double(bz))); z <= std::min(high, double(bz - 1)); ++z)
      by_layer[size_t(z)].push_back(t);
  }
  ::tbb::parallel_for(0, bz, [&](int z) {
    const LayerSigns signs(set, z, mesh, shells, by_layer[size_t(z)]);
    for (int y = 0; y < by; ++y) {
      for (int x = 0; x < bx; ++x)
        visit((z * by + y) * bx + x, [&](int corner) { return signs.inside(x, y, corner); });
    }
  });
}

/// Whether a corner and all next to it are inside: no surface of the solid is near. Not told of
/// corners on a side of the block.
template <class IsInside>
bool deep_inside(int corner, const IsInside& inside) {
  for (const int k : {corner % 9, corner / 9 % 9, corner / 81})
    if (k == 0 || k == LevelSet::side) return false;
  for (int k = 0; k < 27; ++k)
    if (!inside(corner + (k / 9 - 1) * 81 + (k / 3 % 3 - 1) * 9 + k % 3 - 1)) return false;
  return true;
}

/// Whether what filling found inside is so. Within three quarters of a voxel of the surface either
/// may be right: thin parts are rounded off. But faces that other shells hide are no surface.
bool filled_right(const LevelSet& set, const TriangleMesh& mesh, const Shells& shells) {
  std::atomic<bool> right{true};
  for_each_sign(set, mesh, shells, [&](int b, const auto& inside) {
    const int block = set.block[size_t(b)];
    if (block < 0) {
      if ((block == LevelSet::inside) != inside(0)) right = false;
      return;
    }
    const float* value = set.value.data() + size_t(block) * LevelSet::corners;
    for (int k = 0; k < LevelSet::corners; ++k) {
      if (std::abs(value[k]) > 0.75f * set.voxel) {
        if ((value[k] < 0) != inside(k)) right = false;
      } else if (deep_inside(k, inside)) {
        right = false;
      }
    }
  });
  return right;
}

void set_signs(LevelSet& set, const TriangleMesh& mesh, const Shells& shells) {
  for_each_sign(set, mesh, shells, [&](int b, const auto& inside) {
    int& block = set.block[size_t(b)];
    if (block < 0) {
      block = inside(0) ? LevelSet::inside : LevelSet::outside;
      return;
    }
    float* value = set.value.data() + size_t(block) * LevelSet::corners;
    for (int k = 0; k < LevelSet::corners; ++k)
      value[k] = std::copysign(value[k], inside(k) ? -1.f : 1.f);
  });
}

// ---- faces that are no surface ----

/// Triangles, and of each the shell it is of.
struct Faces {
  TriangleMesh mesh;
  std::vector<int> shell;
};

/// Of a corner of a voxel.
bool is_inside(const LevelSet& set, const openvdb::Coord& at) {
  constexpr int side = LevelSet::side;
  int block[3], corner[3];
  for (int k = 0; k < 3; ++k) {
    const int c = at[k] - side * set.low[k];
    if (c < 0 || c >= side * set.blocks[k]) return false;
    block[k] = c / side, corner[k] = c % side;
  }
  const int b = set.block[size_t((block[2] * set.blocks[1] + block[1]) * set.blocks[0] + block[0])];
  if (b < 0) return b == LevelSet::inside;
  // On a face it is 0 with the sign that set_signs gave it.
  return std::signbit(set.value[size_t(b) * LevelSet::corners +
                                size_t((corner[2] * 9 + corner[1]) * 9 + corner[0])]);
}

/// The triangles less what lies within a set: faces that cross into another shell. What is left of
/// a triangle ends about a voxel from where it goes in.
class VisibleFaces {
 public:
  /// @param may_hide  a shell's faces
  template <class MayHide>
  VisibleFaces(const LevelSet& set, const Faces& faces, const MayHide& may_hide) : set_(set) {
    const auto& at = faces.mesh.position;
    for (size_t k = 0; k < faces.shell.size(); ++k) {
      const auto& t = faces.mesh.triangle[k];
      const std::array<V3f, 3> corners{at[t.x], at[t.y], at[t.z]};
      shell_ = faces.shell[k];
      if (!may_hide(shell_) || keep(corners)) add(corners);
    }
  }
  bool hides() const { return hides_; }
  Faces take() { return std::move(visible_); }

 private:
  /// @return whether all of it is to be kept; if not, what is has been added.
  bool keep(const std::array<V3f, 3>& t) {
    int longest = 0;
    float length[3];
    for (int k = 0; k < 3; ++k) {
      length[k] = (t[size_t(k + 1) % 3] - t[size_t(k)]).length();
      if (length[k] > length[longest]) longest = k;
    }
    const V3f middle = (t[size_t(longest)] + t[size_t(longest + 1) % 3]) * 0.5f;
    const bool of_rounding = middle == t[size_t(longest)] || middle == t[size_t(longest + 1) % 3];
    if (length[longest] <= set_.voxel || of_rounding) {
      const bool hidden = is_within((t[0] + t[1] + t[2]) / 3);
      hides_ |= hidden;
      return !hidden;
    }
    const V3f &a = t[size_t(longest)], &b = t[size_t(longest + 1) % 3],
              &c = t[size_t(longest + 2) % 3];
    const std::array<V3f, 3> halves[] = {{a, middle, c}, {middle, b, c}};
    const bool first = keep(halves[0]), second = keep(halves[1]);
    if (first && second) return true;
    if (first) add(halves[0]);
    if (second) add(halves[1]);
    return false;
  }
  /// Whether all corners of voxels within a voxel along each axis are inside.
  bool is_within(const V3f& p) const {
    int low[3], high[3];
    for (int k = 0; k < 3; ++k) {
      const double at = std::clamp(double(p[k] / set_.voxel), -1e9, 1e9);
      low[k] = int(std::ceil(at - 1)), high[k] = int(std::floor(at + 1));
    }
    for (int z = low[2]; z <= high[2]; ++z)
      for (int y = low[1]; y <= high[1]; ++y)
        for (int x = low[0]; x <= high[0]; ++x)
          if (!is_inside(set_, {x, y, z})) return false;
    return true;
  }
  void add(const std::array<V3f, 3>& t) {
    auto& [mesh, shell] = visible_;
    const auto first = uint32_t(mesh.position.size());
    mesh.position.insert(mesh.position.end(), t.begin(), t.end());
    mesh.triangle.emplace_back(first, first + 1, first + 2);
    shell.push_back(shell_);
  }

  const LevelSet& set_;
  Faces visible_;
  int shell_ = 0;
  bool hides_ = false;
};

/// Of the blocks of a set: what one shell holds.
LevelSet set_of(int shell, LevelSet set, const TriangleMesh& mesh, const Shells& shells) {
  TriangleMesh own;
  own.position = mesh.position;
  for (size_t t = 0; t < mesh.triangle.size(); ++t)
    if (shells.shell[t] == shell) own.triangle.push_back(mesh.triangle[t]);
  set_signs(set, own, {std::vector<int>(own.triangle.size(), 0), {0}, {0}});
  return set;
}

/// What of a mesh is its solid's surface: nothing within the solid, nor, of cavities that cross,
/// within another of them.
/// @param set  with values near all faces. @return nothing if all of them are.
std::optional<TriangleMesh> surface_of(const LevelSet& set, const Faces& faces,
                                       const TriangleMesh& mesh, const Shells& shells) {
  VisibleFaces outside(set, faces, [](int) { return true; });
  bool hides = outside.hides();
  Faces visible = outside.take();
  std::vector<int> count(size_t(shells.bodies()), 0);
  for (const int body : shells.body) ++count[size_t(body)];
  for (int s = 0; s < shells.count(); ++s) {
    const int body = shells.body[size_t(s)];
    if (!shells.is_cavity(s) || count[size_t(body)] < 2) continue;
    const LevelSet held = set_of(s, set, mesh, shells);
    VisibleFaces beyond(
        held, visible, [&](int other) { return other != s && shells.body[size_t(other)] == body; });
    hides |= beyond.hides();
    visible = beyond.take();
  }
  if (!hides) return {};
  return std::move(visible.mesh);
}

// ---- what is asked for, and what it takes ----

/// The part of a convex polygon on one side of a plane across axis k.
std::vector<V3d> cut(const std::vector<V3d>& polygon, int k, double at, double side) {
  std::vector<V3d> kept;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const V3d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double da = side * (a[k] - at), db = side * (b[k] - at);
    if (da >= 0) kept.push_back(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) kept.push_back(a + (b - a) * (da / (da - db)));
  }
  return kept;
}

/// What of the triangles lies in a box: no closed mesh, but at the same distances near it.
Faces part_within(const TriangleMesh& mesh, const Shells& shells, const Bounds& box) {
  Faces faces;
  TriangleMesh& part = faces.mesh;
  for (size_t source = 0; source < mesh.triangle.size(); ++source) {
    const auto& t = mesh.triangle[source];
    std::vector<V3d> polygon;
    for (int c = 0; c < 3; ++c) polygon.emplace_back(mesh.position[t[c]]);
    for (int k = 0; k < 3 && !polygon.empty(); ++k) {
      polygon = cut(polygon, k, box.low[k], 1);
      polygon = cut(polygon, k, box.high[k], -1);
    }
    const auto first = uint32_t(part.position.size());
    for (uint32_t c = 2; c < polygon.size(); ++c)
      part.triangle.emplace_back(first, first + c - 1, first + c);
    if (polygon.size() > 2)
      for (const V3d& p : polygon) part.position.emplace_back(p);
    faces.shell.resize(part.triangle.size(), shells.shell[source]);
  }
  return faces;
}

/// Bytes that a level set takes while it is made, from above: blocks in a band of about ten voxels
/// on either side of the surface, OpenVDB's and its own, copies and lists of the triangles, and
/// what each block has in lists.
/// @param total  blocks, empty ones too.
double bytes_of(const TriangleMesh& mesh, double voxel, double total) {
  double area = 0;
  for (const auto& t : mesh.triangle) {
    const V3d a(mesh.position[t.x]), b(mesh.position[t.y]), c(mesh.position[t.z]);
    area += 0.5 * (b - a).cross(c - a).length();
  }
  constexpr double layers = 3, a_block = 13000, a_triangle = 300, a_list = 32;
  const double blocks = layers * area / (LevelSet::side * LevelSet::side * voxel * voxel);
  return blocks * a_block + double(mesh.triangle.size()) * a_triangle + total * a_list;
}

/// A failing allocation within OpenVDB ends the program, since its trees allocate where they are
/// destroyed: what is needed is asked for before.
void check_memory(double bytes, double voxel, const LevelSetBounds& bounds) {
  const auto refuse = [&](const std::string& why) {
    throw Error(
        fmt::format("its level set in voxels of {:.3g} m (half of fluid.spacing) would "
                    "take about {:.3g} GiB of memory, {}. Use a larger fluid.spacing or a "
                    "smaller mesh (is its scale right?)",
                    voxel, bytes / (1 << 30), why));
  };
  if (bounds.most_bytes > 0 && bytes > bounds.most_bytes)
    refuse(fmt::format("more than the {:.3g} GiB that it may (--memory)",
                       bounds.most_bytes / (1 << 30)));
  void* const probe = bytes < 1e15 ? std::malloc(size_t(bytes)) : nullptr;
  if (!probe) refuse("which the system does not give");
  std::free(probe);
}

}  // namespace

LevelSetMaker level_sets_within(double gib) {
  return [gib](const TriangleMesh& mesh, double voxel, double band, LevelSetBounds bounds) {
    if (gib > 0) bounds.most_bytes = gib * (1 << 30);
    return make_level_set(mesh, voxel, band, bounds);
  };
}

LevelSet make_level_set(const TriangleMesh& mesh, double voxel, double band,
                        const LevelSetBounds& bounds) {
  if (!(voxel > 0) || !(band >= voxel)) throw std::logic_error("make_level_set: voxel or band");
  constexpr double worth_cutting = 256.0 * (1 << 20);
  const Bounds whole = bounds_of(mesh);
  Bounds reach;
  bool beyond = false;
  for (int k = 0; k < 3; ++k) {
    beyond |= whole.low[k] < bounds.low[k] || whole.high[k] > bounds.high[k];
    reach.low[k] = bounds.low[k] - band - 4 * voxel;
    reach.high[k] = bounds.high[k] + band + 4 * voxel;
  }
  LevelSet set;
  set.voxel = float(voxel), set.band = float(band);
  const auto frame_within = [&](const LevelSetBounds& within) {
    frame_blocks(voxels_of(whole, within, voxel, band), set);
  };
  const bool cut = beyond && bytes_of(mesh, voxel, 0) > worth_cutting;
  const Shells shells = find_shells(mesh);
  Faces part = cut ? part_within(mesh, shells, reach) : Faces{};
  const TriangleMesh& near = cut ? part.mesh : mesh;
  check_memory(bytes_of(near, voxel, 0), voxel, bounds);
  frame_within(cut ? bounds : LevelSetBounds{});
  check_memory(bytes_of(near, voxel, blocks_of(set)), voxel, bounds);
  const bool cavities = std::any_of(shells.depth.begin(), shells.depth.end(),
                                    [](int depth) { return depth % 2 == 1; });
  // Asked of every mesh, grooves narrower than a voxel would be taken for hidden.
  bool hidden = shells.bodies() < shells.count();
  if (!cut && !cavities) {
    const FloatGrid::Ptr grid = narrow_band(mesh, voxel, band, Inside::filled);
    frame_blocks(grid->evalActiveVoxelBoundingBox(), set);
    take_values(*grid, mesh, set);
    if (filled_right(set, mesh, shells)) return set;
    hidden = true;
  }
  frame_within(cut ? bounds : LevelSetBounds{});
  const auto make = [&](const TriangleMesh& faces) {
    take_values(*narrow_band(faces, voxel, band, Inside::unknown), faces, set);
    set_signs(set, mesh, shells);
  };
  make(near);
  if (!hidden) return set;
  const Faces faces = cut ? std::move(part) : Faces{mesh, shells.shell};
  if (const auto surface = surface_of(set, faces, mesh, shells)) make(*surface);
  return set;
}

}  // namespace drench
