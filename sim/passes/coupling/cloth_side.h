#pragma once
// From the foot point to a side, a normal and a signed distance (exact coupling).

#include "sim/neighbours/sph_kernels.h"
#include "sim/passes/coupling/geometry.h"
#include "sim/passes/coupling/nearest.h"

namespace drench::sim::DRENCH_BACKEND {

/// Triangles with their neighbours across edges and around vertices.
struct ClothTopology {
  PolygonView polygons;
  const int *neighbour, *sheet, *fan_start, *fan_entry, *rim;
  const int* seam_open;  // of strips, which stand behind the triangles
  int triangles;
  ConstVecView rest_centroid;
  const float* half_thickness;
  Vec3<float> low, high;           // m, half a spacing inside the domain's walls
  const Vec3<float>* rest_period;  // m, by sheet; where one is joined to itself

  DRENCH_HD bool open_strip(int t) const { return t >= triangles && seam_open[t - triangles]; }
  /// The triangle across edge ab, bc or ca; -1: it is free, as that of a seam is until it closes.
  DRENCH_HD int across(int t, int edge) const {
    const int other = neighbour[3 * t + edge];
    return open_strip(other) ? -1 : other;
  }
  /// Is a free edge so near to a wall that no fluid passes between them? Not to a wall that the
  /// sheet lies along.
  DRENCH_HD bool closed_by_wall(Vec3<float> normal, int a, int b) const {
    const Vec3<float> p = polygons.position[a], q = polygons.position[b];
    const float across = 0.5f * length2(normal);
    return (beyond(p.x, q.x, low.x, high.x) && normal.x * normal.x < across) ||
           (beyond(p.y, q.y, low.y, high.y) && normal.y * normal.y < across) ||
           (beyond(p.z, q.z, low.z, high.z) && normal.z * normal.z < across);
  }
  /// Are all free edges that meet in a vertex?
  DRENCH_HD bool closed_at(int vertex) const {
    for (int k = fan_start[vertex]; k < fan_start[vertex + 1]; ++k) {
      const int t = fan_entry[k] / 3, c = fan_entry[k] % 3;
      if (open_strip(t)) continue;
      for (int side = 0; side < 2; ++side) {  // the two edges of the triangle at its corner c
        const int e = (c + 2 * side) % 3;
        if (across(t, e) >= 0) continue;
        const int a = polygons.corner[3 * t + e], b = polygons.corner[3 * t + (e + 1) % 3];
        if (!closed_by_wall(area_normal(t), a, b)) return false;
      }
    }
    return true;
  }
  /// Are two triangles of one sheet within `reach` of each other at rest?
  DRENCH_HD bool on_one_patch(int s, int t, float reach) const {
    if (sheet[s] != sheet[t]) return false;
    Vec3<float> d = rest_centroid[s] - rest_centroid[t];
    if (polygons.corner_positions.joined) d = nearest(d, rest_period[sheet[s]]);
    return length(d) < reach;
  }
  DRENCH_HD static bool beyond(float p, float q, float low, float high) {
    return (p < low && q < low) || (p > high && q > high);
  }

  DRENCH_HD Vec3<float> area_normal(int t) const {  // twice the area along the unit normal
    Vec3<float> a, b, c;
    polygons.corners(t, a, b, c);
    return cross(b - a, c - a);
  }
  DRENCH_HD Vec3<float> unit_normal(int t) const {
    const Vec3<float> n = area_normal(t);
    return n * (1.f / maximum(length(n), 1e-20f));
  }
  /// Angle-weighted pseudo-normal of a vertex: its sign is right for any foot point on the vertex
  /// (Baerentzen and Aanaes 2005).
  DRENCH_HD Vec3<float> vertex_normal(int vertex) const {
    Vec3<float> sum{0.f, 0.f, 0.f};
    for (int k = fan_start[vertex]; k < fan_start[vertex + 1]; ++k) {
      const int t = fan_entry[k] / 3, corner = fan_entry[k] % 3;
      if (open_strip(t)) continue;
      Vec3<float> v[3];
      polygons.corners(t, v[0], v[1], v[2]);
      const Vec3<float> e = v[(corner + 1) % 3] - v[corner], f = v[(corner + 2) % 3] - v[corner];
      const float angle = atan2f(length(cross(e, f)), dot(e, f));
      sum = sum + unit_normal(t) * angle;
    }
    return sum;
  }
};

inline ClothTopology topology_of(const State& state) {
  const ClothState& c = state.cloth;
  const Parameters& p = state.parameters;
  float low[3], high[3];
  for (int k = 0; k < 3; ++k) {
    low[k] = p.wall[k] ? p.low[k] + 0.5f * p.spacing : -1e30f;
    high[k] = p.wall[k] ? p.high[k] - 0.5f * p.spacing : 1e30f;
  }
  return {.polygons = polygons_of(state),
          .neighbour = c.neighbour.data(),
          .sheet = c.sheet.data(),
          .fan_start = polygon_fan_start(c),
          .fan_entry = polygon_fan_entry(c),
          .rim = c.rim.data(),
          .seam_open = c.seam_open.data(),
          .triangles = c.triangles,
          .rest_centroid = c.rest_centroid.view(),
          .half_thickness = c.half_thickness.data(),
          .low = {low[0], low[1], low[2]},
          .high = {high[0], high[1], high[2]},
          .rest_period = c.rest_period.data()};
}

/// The pseudo-normal of a foot point and whether it lies on a free edge, past which there is no
/// cloth.
struct FootNormal {
  Vec3<float> normal;
  bool free_edge;
};

DRENCH_HD FootNormal foot_normal(const ClothTopology& cloth, int t, float wa, float wb, float wc) {
  constexpr float on_edge = 1e-6f;
  const bool za = wa < on_edge, zb = wb < on_edge, zc = wc < on_edge;
  const int* corner = cloth.polygons.corner + 3 * t;
  if (!(za || zb || zc)) return {cloth.unit_normal(t), false};
  if ((za && zb) || (zb && zc) || (za && zc)) {
    const int vertex = corner[!za ? 0 : !zb ? 1 : 2];
    return {cloth.vertex_normal(vertex), cloth.rim[vertex] != 0 && !cloth.closed_at(vertex)};
  }
  const int edge = zc ? 0 : za ? 1 : 2;  // ab, bc, ca
  const int other = cloth.across(t, edge);
  if (other < 0) {
    const Vec3<float> n = cloth.unit_normal(t);
    return {n, !cloth.closed_by_wall(n, corner[edge], corner[(edge + 1) % 3])};
  }
  return {cloth.unit_normal(t) + cloth.unit_normal(other), false};
}

/// How far inside the nearest free edge of its triangle the foot lies, over half a spacing: 0..1.
DRENCH_HD float edge_weight(const ClothTopology& cloth, int t, float wa, float wb, float wc,
                            float spacing) {
  if (cloth.across(t, 0) >= 0 && cloth.across(t, 1) >= 0 && cloth.across(t, 2) >= 0) return 1.f;
  float inside = 1.f;
  const float weight[3] = {wc, wa, wb};  // of the corner opposite edges ab, bc, ca
  Vec3<float> v[3];
  cloth.polygons.corners(t, v[0], v[1], v[2]);
  const Vec3<float> area = cloth.area_normal(t);
  const float twice_area = length(area);
  for (int e = 0; e < 3; ++e) {
    const int a = cloth.polygons.corner[3 * t + e], b = cloth.polygons.corner[3 * t + (e + 1) % 3];
    if (cloth.across(t, e) >= 0 || cloth.closed_by_wall(area, a, b)) continue;
    const float edge_length = maximum(length(v[(e + 1) % 3] - v[e]), 1e-20f);
    inside = minimum(inside, weight[e] * twice_area / (edge_length * 0.5f * spacing));
  }
  return max0(inside);
}

/// Side, normal, signed distance, m, and fraction of density of every particle near cloth, from its
/// nearest triangle (find_nearest_triangles). The side is taken from the geometry when a particle
/// comes within reach; the weakly compressible fluid remembers it while its nearest triangle stays
/// on the same patch (rest centroids within two supports); memory ends beyond the support and at
/// free edges.
/// @param position  m, of the particles
void find_cloth_sides(State& state, const ConstVecView& position);

}  // namespace drench::sim::DRENCH_BACKEND
