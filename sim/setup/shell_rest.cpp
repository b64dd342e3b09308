#include "sim/setup/shell_rest.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace drench::sim {

using namespace cpu;

namespace {

using Imath::V2d;
using Imath::V3d;
using Row = std::array<double, 3>;  // of (xx, yy, 2 xy), or of three corners or sides

constexpr double misfit = 1e-6;     // eps over the mean of the diagonal of C D^-1 C^T
constexpr double stiffest = 1e4;    // of a patch, over an equilateral one
constexpr double equilateral = 20;  // sum of its diagonal over D / side^2

double dot(const Row& a, const Row& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// A triangle in its plane: axes, places of its corners, normals of its sides.
struct Frame {
  V3d origin, warp, weft, normal;
  std::array<V2d, 3> corner;
  std::array<V2d, 3> gradient;  // 1/m, of the barycentric coordinates
  double area;

  V2d along(V3d v) const { return {warp.dot(v), weft.dot(v)}; }
  V2d side(int k) const { return corner[(k + 1) % 3] - corner[k]; }
  V2d outward(int k) const {  // of the length of the side
    const V2d s = side(k);
    return {s.y, -s.x};
  }
  Row barycentric(V2d place) const {
    Row l;
    for (int c = 0; c < 3; ++c) l[c] = 1 + gradient[c].dot(place - corner[c]);
    return l;
  }
  /// At a place, of the quadratic that vanishes at the corners and has unit second derivatives
  /// (xx, yy, 2 xy): the error of linear interpolation, -1/2 sum_c L_c (X_c - X)^T H (X_c - X).
  Row bubble(V2d place) const {
    const Row l = barycentric(place);
    Row b{0, 0, 0};
    for (int c = 0; c < 3; ++c) {
      const V2d d = corner[c] - place;
      b[0] -= l[c] * d.x * d.x / 2, b[1] -= l[c] * d.y * d.y / 2, b[2] -= l[c] * d.x * d.y / 2;
    }
    return b;
  }
  /// Its derivative along a direction at the middle of side k, by a central difference: exact for a
  /// quadratic.
  Row bubble_slope(int k, V2d direction) const {
    const V2d middle = (corner[k] + corner[(k + 1) % 3]) * 0.5;
    const double step = std::sqrt(area);
    const Row high = bubble(middle + direction * step), low = bubble(middle - direction * step);
    return {(high[0] - low[0]) / (2 * step), (high[1] - low[1]) / (2 * step),
            (high[2] - low[2]) / (2 * step)};
  }
};

/// The direction in which u rises steepest, else `warp` or z, in the plane of the triangle.
V3d warp_axis(const ShellSurface& s, const std::array<int, 3>& t, V3d normal) {
  const V3d e = s.rest[t[1]] - s.rest[t[0]], f = s.rest[t[2]] - s.rest[t[0]];
  const auto in_plane = [&](V3d v) { return v - normal * normal.dot(v); };
  if (!s.uv.empty()) {
    const double du = s.uv[t[1]].x - s.uv[t[0]].x, dv = s.uv[t[2]].x - s.uv[t[0]].x;
    const V3d rise = f.cross(normal) * du + normal.cross(e) * dv;  // times twice the area
    const double twice = e.cross(f).length();
    if (rise.length() * std::sqrt(twice) > 1e-9 * twice) return rise.normalized();
  }
  const V3d along = in_plane(s.warp.normalized());
  return along.length() > 0.1 ? along.normalized() : in_plane({0, 0, 1}).normalized();
}

Frame frame_of(const ShellSurface& s, const std::array<int, 3>& t) {
  Frame f;
  f.origin = s.rest[t[0]];
  const V3d twice = (s.rest[t[1]] - f.origin).cross(s.rest[t[2]] - f.origin);
  f.area = twice.length() / 2, f.normal = twice.normalized();
  f.warp = warp_axis(s, t, f.normal), f.weft = f.normal.cross(f.warp);
  for (int c = 0; c < 3; ++c) f.corner[c] = f.along(s.rest[t[c]] - f.origin);
  for (int c = 0; c < 3; ++c) {
    const V2d across = f.side((c + 1) % 3);
    f.gradient[c] = V2d(-across.y, across.x) / (2 * f.area);
  }
  return f;
}

/// Inverse of a symmetric positive definite matrix of n <= 3 rows, by Gauss and Jordan.
std::array<Row, 3> inverse(std::array<Row, 3> a, int n) {
  std::array<Row, 3> b{Row{1, 0, 0}, Row{0, 1, 0}, Row{0, 0, 1}};
  for (int k = 0; k < n; ++k) {
    const double pivot = 1 / a[k][k];
    for (int j = 0; j < n; ++j) a[k][j] *= pivot, b[k][j] *= pivot;
    for (int i = 0; i < n; ++i) {
      if (i == k) continue;
      const double factor = a[i][k];
      for (int j = 0; j < n; ++j) a[i][j] -= factor * a[k][j], b[i][j] -= factor * b[k][j];
    }
  }
  return b;
}

Row compliance_times(const Rigidity<double>& d, const Row& m) {
  const double det = d.d11 * d.d22 - d.d12 * d.d12;
  return {(d.d22 * m[0] - d.d12 * m[1]) / det, (d.d11 * m[1] - d.d12 * m[0]) / det, m[2] / d.d66};
}

enum class Side { free, joined, clamped };

/// What a point adds to second derivatives, by its place.
struct Point {
  int vertex;
  V3d offset;  // m, of the vertex as the triangle sees it across a seam
  Row weight;
};

/// The quadratic surface of a triangle.
struct Patch {
  Frame frame;
  std::array<Side, 3> side;
  std::array<Point, 3> flap;     // the far corner across a side; its weight is dkappa / dd
  std::array<Row, 3> reach;      // barycentric coordinates of its place
  std::array<Row, 3> condition;  // C: d of a surface of unit second derivatives
  std::vector<Point> kappa;
  bool is_whole;  // determined by conditions, or by neighbours
};

int corner_across(const ShellSurface& s, int triangle, int neighbour) {
  for (int k = 0; k < 3; ++k)
    if (s.neighbour[neighbour][k] == triangle) return k;
  return -1;
}

int node_of(const ShellSurface& s, int vertex) { return s.node.empty() ? vertex : s.node[vertex]; }
V3d shift_of(const ShellSurface& s, int vertex) {
  return s.shift.empty() ? V3d(0) : s.shift[vertex];
}
bool is_held(const ShellSurface& s, const std::array<int, 3>& t) {
  if (s.held.empty()) return false;
  return s.held[node_of(s, t[0])] && s.held[node_of(s, t[1])] && s.held[node_of(s, t[2])];
}

/// m, of the vertices of the neighbour across side k as the triangle sees them.
V3d offset_across(const ShellSurface& s, int t, int k) {
  const int n = s.neighbour[t][k];
  return shift_of(s, s.triangle[t][k]) -
         shift_of(s, s.triangle[n][(corner_across(s, t, n) + 1) % 3]);
}

/// Where the far corner of a neighbour lies when it is folded about side k into the plane of the
/// triangle: by the lengths along and across the side, taken in the neighbour's own plane.
V2d unfolded(const ShellSurface& s, const Frame& f, int k, const std::array<int, 3>& t,
             int shared) {
  const V3d a = s.rest[t[(shared + 1) % 3]], b = s.rest[t[shared]],
            far = s.rest[t[(shared + 2) % 3]];
  const V3d side = b - a, leg = far - a;
  const double length2 = side.length2(), along = leg.dot(side) / length2,
               across = side.cross(leg).length() / length2;
  return f.corner[k] + f.side(k) * along + f.outward(k) * across;
}

/// C kappa = d of the flaps that there are, d_k the offset of flap k from the plane of the
/// triangle: kappa = D^-1 C^T (C D^-1 C^T + eps)^-1 d is of least energy among what fits.
void fit_quadratic(Patch& p, const Rigidity<double>& bending) {
  std::array<int, 3> with;
  int n = 0;
  for (int k = 0; k < 3; ++k)
    if (p.side[k] != Side::free) with[n++] = k;
  std::array<Row, 3> gram{}, compliant{};
  double trace = 0;
  for (int i = 0; i < n; ++i) {
    compliant[i] = compliance_times(bending, p.condition[with[i]]);
    for (int j = 0; j < n; ++j) gram[j][i] = dot(compliant[i], p.condition[with[j]]);
    trace += gram[i][i];
  }
  for (int i = 0; i < n; ++i) gram[i][i] += misfit * trace / n;
  const std::array<Row, 3> fit = inverse(gram, n);
  for (int j = 0; j < n; ++j) {
    Row& weight = p.flap[with[j]].weight;
    for (int i = 0; i < n; ++i)
      for (int r = 0; r < 3; ++r) weight[r] += compliant[i][r] * fit[i][j];
  }
}

Patch patch_of(const ShellSurface& s, int t, const Rigidity<double>& bending) {
  Patch p;
  p.frame = frame_of(s, s.triangle[t]);
  for (int k = 0; k < 3; ++k) {
    const int n = s.neighbour[t][k];
    p.side[k] = n < 0 ? Side::free : is_held(s, s.triangle[n]) ? Side::clamped : Side::joined;
    p.flap[k] = {-1, V3d(0), {0, 0, 0}};
    if (n < 0) continue;
    const int shared = corner_across(s, t, n);
    p.flap[k].vertex = s.triangle[n][(shared + 2) % 3];
    p.flap[k].offset = offset_across(s, t, k);
    const V2d place = unfolded(s, p.frame, k, s.triangle[n], shared);
    p.reach[k] = p.frame.barycentric(place);
    p.condition[k] = p.frame.bubble(place);
    if (p.side[k] != Side::clamped) continue;
    // the plane of the neighbour continues the surface: its slope, times its height, is d
    const V2d normal = p.frame.outward(k).normalized();
    const double height = normal.dot(place - p.frame.corner[k]);
    p.condition[k] = p.frame.bubble_slope(k, normal);
    for (double& entry : p.condition[k]) entry *= height;
  }
  p.is_whole = std::count(p.side.begin(), p.side.end(), Side::free) == 0;
  fit_quadratic(p, bending);
  return p;
}

Row sum(const Row& a, const Row& b, double w) {
  return {a[0] + w * b[0], a[1] + w * b[1], a[2] + w * b[2]};
}

/// Second derivatives in axes that are turned by the angle of cosine c and sine s against theirs.
Row turned(const Row& k, double c, double s) {
  return {c * c * k[0] + s * s * k[1] + c * s * k[2], s * s * k[0] + c * c * k[1] - c * s * k[2],
          2 * c * s * (k[1] - k[0]) + (c * c - s * s) * k[2]};
}

/// What the patch says by its own flaps.
std::vector<Point> own_points(const ShellSurface& s, int t, const Patch& p) {
  std::vector<Point> points;
  for (int c = 0; c < 3; ++c) points.push_back({s.triangle[t][c], V3d(0), {0, 0, 0}});
  for (int k = 0; k < 3; ++k) {
    if (p.side[k] == Side::free) continue;
    points.push_back(p.flap[k]);
    for (int c = 0; c < 3; ++c)
      points[c].weight = sum(points[c].weight, p.flap[k].weight, -p.reach[k][c]);
  }
  return points;
}

/// A patch at a free side lacks a condition: of the surfaces that fit, the one whose second
/// derivatives are nearest to the mean of those of its neighbours that lack none.
void follow_neighbours(const ShellSurface& s, std::vector<Patch>& patches, int t) {
  Patch& p = patches[t];
  std::vector<int> whole;
  for (int k = 0; k < 3; ++k)
    if (p.side[k] == Side::joined && patches[s.neighbour[t][k]].is_whole) whole.push_back(k);
  for (const int k : whole) {
    const int n = s.neighbour[t][k], shared = corner_across(s, t, n);
    const V2d here = p.frame.side(k).normalized(),
              there = -patches[n].frame.side(shared).normalized();
    const double cosine = here.dot(there), sine = there.x * here.y - there.y * here.x;
    for (Point point : patches[n].kappa) {
      // the side is turned by +angle, so this triangle's axes by -angle against the neighbour's
      const Row mean = turned(point.weight, cosine, -sine);
      point.weight = mean;
      for (int j = 0; j < 3; ++j)
        if (p.side[j] != Side::free)
          point.weight = sum(point.weight, p.flap[j].weight, -dot(p.condition[j], mean));
      for (double& w : point.weight) w /= double(whole.size());
      point.offset += p.flap[k].offset;
      p.kappa.push_back(point);
    }
  }
}

/// First those beside whole patches, then those beside these, as at corners of a sheet. What is
/// left, as where a strip is one triangle wide, has the least energy that fits.
void complete_patches(const ShellSurface& s, std::vector<Patch>& patches) {
  for (int round = 0; round < 2; ++round) {
    std::vector<int> completed;
    for (int t = 0; t < int(patches.size()); ++t) {
      if (patches[t].is_whole) continue;
      const size_t own = patches[t].kappa.size();
      follow_neighbours(s, patches, t);
      if (patches[t].kappa.size() > own) completed.push_back(t);
    }
    for (const int t : completed) patches[t].is_whole = true;
  }
}

/// The nodes of a patch of patches, each once.
struct Gathered {
  const ShellSurface& surface;
  BendingPatch& patch;
  std::vector<V3d>& place;  // m, at rest

  void add(int vertex, V3d offset, const Curvature<double>& w) {
    const int node = node_of(surface, vertex);
    const V3d shift = shift_of(surface, vertex) + offset;
    const double near = 1e-6 * shift.length();
    const auto same = [&](const PatchNode& p) {
      return p.index == node && (p.shift - shift).length() <= near;
    };
    auto at = std::find_if(patch.node.begin(), patch.node.end(), same);
    if (at == patch.node.end()) {
      at = patch.node.insert(at, {node, shift, {0, 0, 0}});
      place.push_back(surface.rest[vertex] + offset);
    }
    at->weight.xx += w.xx, at->weight.yy += w.yy, at->weight.xy += w.xy;
  }
};

/// Adds side k's part of the second derivatives, (1/A) l sym(n (g n + t dx/dt)^T), g the slope.
void add_side(const ShellSurface& s, const std::vector<Patch>& patches, int t, int k,
              Gathered& to) {
  const Patch& p = patches[t];
  const auto& corner = s.triangle[t];
  const V2d across = p.frame.outward(k), side = p.frame.side(k);
  const double length = side.length(), scale = 1 / (p.frame.area * length);
  const auto along = [&](V2d direction, double w) {  // of w times a unit derivative
    return Curvature<double>{w * across.x * direction.x, w * across.y * direction.y,
                             w * (across.x * direction.y + across.y * direction.x)};
  };
  const double chord = scale / length;
  to.add(corner[(k + 1) % 3], V3d(0), along(side, chord));
  to.add(corner[k], V3d(0), along(side, -chord));
  const bool mean = p.side[k] == Side::joined;
  const auto add_slope = [&](int of, int shown, double w, V3d offset) {
    const Frame& f = patches[of].frame;
    const V2d normal = f.outward(shown).normalized();
    const Row rise = f.bubble_slope(shown, normal);
    for (int c = 0; c < 3; ++c)
      to.add(s.triangle[of][c], offset, along(across, w * f.gradient[c].dot(normal)));
    for (const Point& point : patches[of].kappa)
      to.add(point.vertex, offset + point.offset, along(across, w * dot(rise, point.weight)));
  };
  add_slope(t, k, (mean ? 0.5 : 1) * scale, V3d(0));
  if (!mean) return;
  const int n = s.neighbour[t][k];
  add_slope(n, corner_across(s, t, n), -0.5 * scale, offset_across(s, t, k));
}

/// Curvature at rest: what it has along the normal is kappa_0. What it has in the plane turns and
/// stretches with the triangle, by its own corners.
void take_rest(const Frame& f, const std::vector<V3d>& place, BendingPatch& patch) {
  Curvature<V3d> kappa{V3d(0), V3d(0), V3d(0)};
  for (size_t k = 0; k < place.size(); ++k) {
    const V3d x = place[k] - f.origin;
    const auto& w = patch.node[k].weight;
    kappa = {kappa.xx + x * w.xx, kappa.yy + x * w.yy, kappa.xy + x * w.xy};
  }
  patch.rest = {f.normal.dot(kappa.xx), f.normal.dot(kappa.yy), f.normal.dot(kappa.xy)};
  for (int c = 0; c < 3; ++c) {
    auto& w = patch.node[c].weight;
    w.xx -= f.gradient[c].dot(f.along(kappa.xx));
    w.yy -= f.gradient[c].dot(f.along(kappa.yy));
    w.xy -= f.gradient[c].dot(f.along(kappa.xy));
  }
}

/// See shell_rest: a patch that is far stiffer than its size tells is a sliver.
double share_of(const Frame& f, const BendingPatch& patch, const Rigidity<double>& bending) {
  double longest = 0, trace = 0;
  for (int k = 0; k < 3; ++k) longest = std::max(longest, f.side(k).length2());
  for (const PatchNode& n : patch.node)
    trace += bending_weight(f.area, bending, n.weight, n.weight);
  const double most = stiffest * equilateral * std::max(bending.d11, bending.d22) / longest;
  return trace > most ? most / trace : 1;
}

BendingPatch bending_patch(const ShellSurface& s, const std::vector<Patch>& patches, int t,
                           const Rigidity<double>& bending) {
  BendingPatch patch;
  if (is_held(s, s.triangle[t])) return patch;
  std::vector<V3d> place;
  Gathered gathered{s, patch, place};
  for (const int v : s.triangle[t]) gathered.add(v, V3d(0), {0, 0, 0});
  for (int k = 0; k < 3; ++k) add_side(s, patches, t, k, gathered);
  take_rest(patches[t].frame, place, patch);
  patch.share = share_of(patches[t].frame, patch, bending);
  return patch;
}

}  // namespace

Rigidity<double> rigidity_of_fabric(double warp, double weft, double bias, double poisson) {
  const double d12 = poisson * std::sqrt(warp * weft);
  const double d66 = bias - (warp + weft + 2 * d12) / 4;
  return {.d11 = warp, .d22 = weft, .d12 = d12, .d66 = std::max(d66, 0.005 * (warp + weft))};
}

Rigidity<double> rigidity_of_plate(double bending, double poisson) {
  return {
      .d11 = bending, .d22 = bending, .d12 = poisson * bending, .d66 = (1 - poisson) / 2 * bending};
}

ShellRest shell_rest(const ShellSurface& surface, const ShellConstants& constants) {
  ShellRest rest;
  rest.bending = constants.bending;
  int nodes = 0;
  for (int v = 0; v < int(surface.rest.size()); ++v)
    nodes = std::max(nodes, node_of(surface, v) + 1);
  rest.mass.assign(nodes, 0.0);
  std::vector<Patch> patches;
  for (int t = 0; t < int(surface.triangle.size()); ++t) {
    patches.push_back(patch_of(surface, t, constants.bending));
    const Frame& f = patches.back().frame;
    rest.triangle.push_back({.area = f.area,
                             .gradient_x = {f.gradient[1].x, f.gradient[2].x},
                             .gradient_y = {f.gradient[1].y, f.gradient[2].y}});
    for (const int v : surface.triangle[t])
      rest.mass[node_of(surface, v)] += constants.areal_density * f.area / 3;
  }
  for (int t = 0; t < int(surface.triangle.size()); ++t)
    patches[t].kappa = own_points(surface, t, patches[t]);
  complete_patches(surface, patches);
  for (int t = 0; t < int(surface.triangle.size()); ++t)
    rest.patch.push_back(bending_patch(surface, patches, t, constants.bending));
  return rest;
}

BendingMatrix bending_matrix(const ShellRest& rest, size_t nodes) {
  std::vector<std::map<int, double>> row(nodes);
  BendingMatrix matrix;
  matrix.push.assign(nodes, V3d(0));
  for (size_t t = 0; t < rest.patch.size(); ++t) {
    const BendingPatch& p = rest.patch[t];
    const double area = rest.triangle[t].area * p.share;
    for (const PatchNode& i : p.node) {
      for (const PatchNode& j : p.node) {
        const double w = bending_weight(area, rest.bending, i.weight, j.weight);
        row[i.index][j.index] += w;
        matrix.push[i.index] -= j.shift * w;
      }
    }
  }
  for (const auto& entries : row) {
    matrix.start.push_back(int(matrix.column.size()));
    for (const auto& [column, w] : entries)
      matrix.column.push_back(column), matrix.weight.push_back(w);
  }
  matrix.start.push_back(int(matrix.column.size()));
  return matrix;
}

}  // namespace drench::sim
