#include "sim/setup/cloth_shell.h"

#include <algorithm>
#include <cmath>

#include "sim/setup/shell_rest.h"

namespace drench::sim {

namespace {

/// Differences of the snapped places: those of world coordinates would depend on where the shot
/// stands.
ShellSurface surface_of(const Sheet& sheet, const Cloth& cloth, const LocalFrame& frame,
                        const ClothTopology& topology, int base_triangle) {
  ShellSurface s;
  for (const V3d& p : sheet.rest)
    s.rest.push_back({frame.to_local(0, p.x), frame.to_local(1, p.y), frame.to_local(2, p.z)});
  for (const Imath::V2f& uv : sheet.uv) s.uv.push_back(Imath::V2d(uv));
  for (size_t k = 0; k < sheet.triangle.size(); ++k) {
    const auto& t = sheet.triangle[k];
    s.triangle.push_back({int(t.x), int(t.y), int(t.z)});
    std::array<int, 3> beside;
    for (size_t c = 0; c < 3; ++c) {
      const int n = topology.neighbour[3 * (size_t(base_triangle) + k) + c];
      beside[c] = n < 0 ? -1 : n - base_triangle;
    }
    s.neighbour.push_back(beside);
  }
  s.node.assign(sheet.node.begin(), sheet.node.end());
  if (sheet.joined())
    for (const Imath::V3i& image : sheet.image) s.shift.push_back(V3d(image) * sheet.period);
  for (const bool held : sheet.held) s.held.push_back(char(held));
  s.warp = cloth.mesh_file.empty() ? cloth.u : V3d(1, 0, 0);
  return s;
}

/// Rows of the matrix: who shares a triangle first.
void append_rows(const Sheet& sheet, const BendingMatrix& bending, ShellTopology& t, int base) {
  const int nodes = int(sheet.point.size());
  std::vector<std::vector<int>> ring(static_cast<size_t>(nodes));
  for (const auto& corner : sheet.triangle) {
    for (int c = 0; c < 3; ++c) {
      const int a = sheet.node[corner[c]], b = sheet.node[corner[(c + 1) % 3]];
      ring[size_t(a)].push_back(b), ring[size_t(b)].push_back(a);
    }
  }
  for (size_t i = 0; i < size_t(nodes); ++i) {
    auto& near = ring[i];
    std::sort(near.begin(), near.end());
    near.erase(std::unique(near.begin(), near.end()), near.end());
    const auto weight_of = [&](int j) {
      const auto first = bending.column.begin() + bending.start[i],
                 last = bending.column.begin() + bending.start[i + 1],
                 found = std::lower_bound(first, last, j);
      return found == last || *found != j ? 0.
                                          : bending.weight[size_t(found - bending.column.begin())];
    };
    for (const int j : near) t.column.push_back(j + base), t.bend.push_back(-float(weight_of(j)));
    t.ring.push_back(int(near.size()));
    for (int k = bending.start[i]; k < bending.start[i + 1]; ++k) {
      const int j = bending.column[size_t(k)];
      if (j == int(i) || std::binary_search(near.begin(), near.end(), j)) continue;
      t.column.push_back(j + base), t.bend.push_back(-float(bending.weight[size_t(k)]));
    }
    t.row_start.push_back(int(t.column.size()));
  }
}

/// Positive definite. A sheet without rigidity has patches all the same, whose weights are not
/// used.
cpu::Rigidity<double> rigidity_of(const Cloth& cloth, double stiffest) {
  if (stiffest == 0) return rigidity_of_plate(1, 0);
  const double least = 1e-3 * stiffest;
  return rigidity_of_fabric(std::max(cloth.bend_warp, least), std::max(cloth.bend_weft, least),
                            cloth.bend_bias, cloth.poisson);
}

BendingMatrix no_bending(size_t nodes) {
  return {.start = std::vector<int>(nodes + 1, 0),
          .column = {},
          .weight = {},
          .push = std::vector<V3d>(nodes, V3d(0))};
}

void end_patch(PatchTopology& p) {
  p.start.push_back(int(p.node.size()));
  for (std::vector<float>& rest : p.rest) rest.push_back(0.f);
  for (std::vector<float>* shift : {&p.shift_x, &p.shift_y, &p.shift_z})
    shift->insert(shift->end(), 3, 0.f);
}

/// A sheet of springs in the company of shells.
void append_nothing(const Sheet& sheet, ShellTopology& t) {
  for (size_t k = 0; k < sheet.triangle.size(); ++k) {
    t.area.push_back(0.f);
    for (auto& gradient : t.gradient) gradient.push_back(0.f);
    end_patch(t.patch);
  }
  t.law.push_back({});
  for (size_t i = 0; i < sheet.point.size(); ++i)
    t.ring.push_back(0), t.row_start.push_back(int(t.column.size()));
}

void append_push(const Sheet& sheet, const BendingMatrix* bending, ShellTopology& t) {
  for (size_t i = 0; i < sheet.point.size(); ++i) {
    const V3d push = bending ? bending->push[i] : V3d(0);
    t.push_x.push_back(float(push.x)), t.push_y.push_back(float(push.y)),
        t.push_z.push_back(float(push.z));
  }
}

/// A triangle that turns by less than a millionth over its own size is flat.
bool is_curved(const ShellRest& rest, size_t k) {
  const auto& r = rest.patch[k].rest;
  return std::hypot(r.xx, r.yy, r.xy) * std::sqrt(rest.triangle[k].area) >= 1e-6;
}

void append_patch(const ShellRest& rest, size_t k, int base, PatchTopology& to) {
  const BendingPatch& p = rest.patch[k];
  const double root = std::sqrt(rest.triangle[k].area * p.share);
  V3d shift[3] = {V3d(0), V3d(0), V3d(0)};
  for (const PatchNode& n : p.node) {
    const double weight[3] = {n.weight.xx * root, n.weight.yy * root, n.weight.xy * root};
    to.node.push_back(n.index + base);
    for (size_t c = 0; c < 3; ++c) {
      to.weight[c].push_back(float(weight[c]));
      shift[c] += n.shift * weight[c];
    }
  }
  end_patch(to);
  const double curvature[3] = {p.rest.xx * root, p.rest.yy * root, p.rest.xy * root};
  for (size_t c = 0; c < 3; ++c) {
    if (is_curved(rest, k)) to.rest[c].back() = float(curvature[c]);
    const size_t at = to.shift_x.size() - 3 + c;
    to.shift_x[at] = float(shift[c].x), to.shift_y[at] = float(shift[c].y),
    to.shift_z[at] = float(shift[c].z);
  }
}

/// @param bends  whether it has rigidity
void append_patches(const ShellRest& rest, const Cloth& cloth, bool bends, int base,
                    PatchTopology& to) {
  bool curved = false;
  for (size_t k = 0; k < rest.patch.size(); ++k) {
    if (bends)
      append_patch(rest, k, base, to), curved = curved || is_curved(rest, k);
    else
      end_patch(to);
  }
  to.used = to.used || curved || (bends && cloth.damping_time > 0);
  to.curved = to.curved || curved;
}

}  // namespace

void append_shell(const Sheet& sheet, const Cloth& cloth, const LocalFrame& frame,
                  ClothTopology& topology) {
  ShellTopology& t = topology.shell;
  if (t.row_start.empty()) t.row_start.push_back(0), t.patch.start.push_back(0);
  if (cloth.model != ClothModel::shell) {
    append_push(sheet, nullptr, t);
    return append_nothing(sheet, t);
  }
  const int base = topology.vertices() - int(sheet.point.size()),
            base_triangle = topology.triangles() - int(sheet.triangle.size());
  const ShellSurface surface = surface_of(sheet, cloth, frame, topology, base_triangle);
  const double stiffest = std::max(cloth.bend_warp, cloth.bend_weft);
  const bool bends = stiffest > 0;
  const ShellRest rest = shell_rest(
      surface, {.areal_density = cloth.areal_density, .bending = rigidity_of(cloth, stiffest)});
  for (const auto& triangle : rest.triangle) {
    t.area.push_back(float(triangle.area));
    for (size_t k = 0; k < 2; ++k) {
      t.gradient[k].push_back(float(triangle.gradient_x[k]));
      t.gradient[2 + k].push_back(float(triangle.gradient_y[k]));
    }
  }
  const auto moduli = cpu::orthotropic<double>(cloth.young_warp, cloth.young_weft,
                                               cloth.shear_modulus, cloth.poisson);
  const auto limit =
      cpu::strain_limit<double>(cloth.stretch_limit, std::max(cloth.young_warp, cloth.young_weft));
  t.law.push_back({.c11 = float(moduli.c11),
                   .c22 = float(moduli.c22),
                   .c12 = float(moduli.c12),
                   .c66 = float(moduli.c66),
                   .limit_start = float(limit.start),
                   .limit_stiffness = float(limit.stiffness),
                   .damping_time = float(cloth.damping_time),
                   .d11 = float(bends * rest.bending.d11),
                   .d22 = float(bends * rest.bending.d22),
                   .d12 = float(bends * rest.bending.d12),
                   .d66 = float(bends * rest.bending.d66)});
  const BendingMatrix bending =
      bends ? bending_matrix(rest, sheet.point.size()) : no_bending(sheet.point.size());
  append_rows(sheet, bending, t, base);
  append_push(sheet, &bending, t);
  append_patches(rest, cloth, bends, base, t.patch);
}

}  // namespace drench::sim
