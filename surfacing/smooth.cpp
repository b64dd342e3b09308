#include "surfacing/smooth.h"

#include <immintrin.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <span>

namespace drench::surfacing {
namespace {

template <class F>
void for_each_vertex(size_t n, F f) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, n, 2048), [&](const auto& range) {
    for (size_t v = range.begin(); v < range.end(); ++v) f(static_cast<uint32_t>(v));
  });
}

/// Chebyshev coefficients over a in [-1, 1] of p^n, p = (1 + a) / 2: n passes. With a = cos(t) it
/// falls as a Gaussian in t, so that few make n: 8 for 20, within 1e-2.
std::vector<float> passes_in_few(int n) {
  constexpr int samples = 512;
  constexpr double least = 1e-2;
  std::vector<float> coefficient;
  double left = 1;  // that the sum at a = 1, where all polynomials are 1, lacks
  for (int k = 0; std::abs(left) > least || k < 3; ++k) {
    double sum = 0;
    for (int s = 0; s < samples; ++s) {
      const double t = (s + 0.5) * std::numbers::pi / samples;
      sum += std::pow(0.5 + 0.5 * std::cos(t), n) * std::cos(k * t);
    }
    coefficient.push_back(static_cast<float>((k == 0 ? 1 : 2) * sum / samples));
    left -= coefficient.back();
  }
  coefficient[0] += static_cast<float>(left);  // what is constant stays
  return coefficient;
}

/// A column with one more row, so that four floats can be read from any.
template <class T>
std::vector<T> padded(const std::vector<T>& column) {
  std::vector<T> copy;
  copy.reserve(column.size() + 1);
  copy.assign(column.begin(), column.end());
  copy.push_back(T(0));
  return copy;
}

V3f mean_of_neighbours(const std::vector<V3f>& padded, const VertexRings& rings, uint32_t v) {
  __m128 sum = _mm_setzero_ps();
  const uint32_t begin = rings.first[v], end = rings.first[v + 1];
  for (uint32_t k = begin; k < end; ++k)
    sum = _mm_add_ps(sum, _mm_loadu_ps(&padded[rings.neighbour[k]].x));
  sum = _mm_div_ps(sum, _mm_set1_ps(static_cast<float>(end - begin)));
  alignas(16) float mean[4];
  _mm_store_ps(mean, sum);
  return {mean[0], mean[1], mean[2]};
}

float mean_of_neighbours(const std::vector<float>& value, const VertexRings& rings, uint32_t v) {
  float sum = 0;
  const uint32_t begin = rings.first[v], end = rings.first[v + 1];
  for (uint32_t k = begin; k < end; ++k) sum += value[rings.neighbour[k]];
  return sum / static_cast<float>(end - begin);
}

/// value = sum of coefficient[k] T_k(A) value, A the mean of the neighbours, by Clenshaw's
/// recurrence. T is V3f or float.
template <class T>
void filter(std::vector<T>& value, const VertexRings& rings,
            const std::vector<float>& coefficient) {
  std::vector<T> before(value.size() + 1, T(0)), now = padded(value);
  for_each_vertex(value.size(), [&](uint32_t v) { now[v] *= coefficient.back(); });
  for (size_t k = coefficient.size() - 2; k > 0; --k) {
    for_each_vertex(value.size(), [&](uint32_t v) {
      before[v] = value[v] * coefficient[k] + mean_of_neighbours(now, rings, v) * 2.f - before[v];
    });
    before.swap(now);
  }
  for_each_vertex(value.size(), [&](uint32_t v) {
    value[v] = value[v] * coefficient[0] + mean_of_neighbours(now, rings, v) - before[v];
  });
}

/// Filters value by `few` and, from the same T_k(A) value, into `smooth` by the longer `many`.
void filter_both(std::vector<V3f>& value, std::vector<V3f>& smooth, const VertexRings& rings,
                 const std::vector<float>& few, const std::vector<float>& many) {
  std::vector<V3f> before(value.size() + 1, V3f(0)), now = padded(value);
  smooth.resize(value.size());
  for_each_vertex(value.size(), [&](uint32_t v) {
    smooth[v] = value[v] * many[0];
    value[v] *= few[0];
  });
  for (size_t k = 1; k < many.size(); ++k) {
    const float turn = k == 1 ? 1.f : 2.f;  // T_1 = A, T_k+1 = 2 A T_k - T_k-1
    const float weight = k < few.size() ? few[k] : 0.f;
    for_each_vertex(value.size(), [&](uint32_t v) {
      before[v] = mean_of_neighbours(now, rings, v) * turn - before[v];
      smooth[v] += before[v] * many[k];
      if (weight != 0) value[v] += before[v] * weight;
    });
    before.swap(now);
  }
}

uint32_t root_of(std::vector<std::atomic<uint32_t>>& parent, uint32_t v) {
  while (true) {
    const uint32_t up = parent[v].load(std::memory_order_relaxed);
    if (up == v) return v;
    const uint32_t further = parent[up].load(std::memory_order_relaxed);
    if (up != further) parent[v].store(further, std::memory_order_relaxed);
    v = up;
  }
}

/// Joins two trees under the lower root, so that a part's root is its lowest vertex whatever the
/// order.
void join(std::vector<std::atomic<uint32_t>>& parent, uint32_t a, uint32_t b) {
  while (true) {
    a = root_of(parent, a);
    b = root_of(parent, b);
    if (a == b) return;
    if (a < b) std::swap(a, b);
    uint32_t expected = a;
    if (parent[a].compare_exchange_strong(expected, b)) return;
  }
}

/// Sum of f over the members of a part, in an order that does not depend on threads.
template <class T, class F>
T sum_over(const Components& parts, size_t part, F f) {
  constexpr uint32_t piece = 8192;
  const uint32_t begin = parts.first[part], end = parts.first[part + 1];
  std::vector<T> sums((end - begin + piece - 1) / piece, T(0));
  tbb::parallel_for(size_t{0}, sums.size(), [&](size_t s) {
    const uint32_t from = begin + static_cast<uint32_t>(s) * piece;
    for (uint32_t k = from; k < std::min(end, from + piece); ++k) sums[s] += f(parts.vertex[k]);
  });
  T total(0);
  for (const T& sum : sums) total += sum;
  return total;
}

V3f normal_times_area(const LatticeMesh& mesh, const VertexRings& rings, uint32_t v) {
  V3f sum(0);
  rings.for_each_triangle(v, [&](uint32_t a, uint32_t b) {
    sum += (mesh.position[a] - mesh.position[v]).cross(mesh.position[b] - mesh.position[v]);
  });
  return sum;
}

V3f unit_or_up(const V3f& v) { return unit_or(v, V3f(0, 1, 0)); }

/// Signed volume of a part, about one of its own vertices so that far parts keep their digits.
double volume_of(const LatticeMesh& mesh, const VertexRings& rings, const Components& parts,
                 size_t part) {
  const V3d about(mesh.position[parts.vertex[parts.first[part]]]);
  return sum_over<double>(parts, part, [&](uint32_t v) {
    const V3d p = V3d(mesh.position[v]) - about;
    double sum = 0;
    rings.for_each_triangle(v, [&](uint32_t a, uint32_t b) {
      if (v < a && v < b)  // each triangle once
        sum += p.dot((V3d(mesh.position[a]) - about).cross(V3d(mesh.position[b]) - about));
    });
    return sum / 6;
  });
}

template <class F>
void for_each_member(const Components& parts, size_t part, F f) {
  tbb::parallel_for(tbb::blocked_range<uint32_t>(parts.first[part], parts.first[part + 1], 2048),
                    [&](const auto& range) {
                      for (uint32_t k = range.begin(); k < range.end(); ++k) f(parts.vertex[k]);
                    });
}

/// Scales a part about its middle to the wanted volume.
void scale_part(LatticeMesh& mesh, const Components& parts, size_t part, double ratio) {
  const double count = parts.first[part + 1] - parts.first[part];
  const V3f middle(sum_over<V3d>(parts, part, [&](uint32_t v) { return V3d(mesh.position[v]); }) /
                   count);
  const float scale = static_cast<float>(std::cbrt(ratio));
  for_each_member(parts, part, [&](uint32_t v) {
    mesh.position[v] = middle + scale * (mesh.position[v] - middle);
  });
}

/// Volumes of a part whose vertices go by s times their normals: coefficients of 1, s, s^2, s^3.
Imath::V4d volume_by_shift(const LatticeMesh& mesh, const VertexRings& rings,
                           const Components& parts, size_t part, const std::vector<V3f>& normal) {
  const V3d about(mesh.position[parts.vertex[parts.first[part]]]);
  return sum_over<Imath::V4d>(parts, part, [&](uint32_t v) {
    const V3d p = V3d(mesh.position[v]) - about, n(normal[v]);
    Imath::V4d sum(0);
    rings.for_each_triangle(v, [&](uint32_t a, uint32_t b) {
      if (v > a || v > b) return;  // each triangle once
      const V3d pa = V3d(mesh.position[a]) - about, pb = V3d(mesh.position[b]) - about,
                na(normal[a]), nb(normal[b]);
      const V3d zero = pa.cross(pb), one = pa.cross(nb) + na.cross(pb), two = na.cross(nb);
      sum += {p.dot(zero), n.dot(zero) + p.dot(one), n.dot(one) + p.dot(two), n.dot(two)};
    });
    return sum / 6.;
  });
}

/// Shifts a part along its normals to the wanted volume, which is a cubic of the shift.
void shift_part(LatticeMesh& mesh, const VertexRings& rings, const Components& parts, size_t part,
                double wanted, std::vector<V3f>& normal) {
  for_each_member(parts, part,
                  [&](uint32_t v) { normal[v] = unit_or_up(normal_times_area(mesh, rings, v)); });
  const Imath::V4d c = volume_by_shift(mesh, rings, parts, part, normal);
  double shift = 0;
  for (int step = 0; step < 4; ++step)
    shift -= (c[0] - wanted + shift * (c[1] + shift * (c[2] + shift * c[3]))) /
             (c[1] + shift * (2 * c[2] + shift * 3 * c[3]));
  const float voxels = static_cast<float>(std::clamp(shift, -0.5, 0.5));
  for_each_member(parts, part, [&](uint32_t v) { mesh.position[v] += voxels * normal[v]; });
}

/// Smooths the positions, see smooth_mesh.
/// @return unit normals of the mesh, to be overwritten.
std::vector<V3f> remove_bumps(LatticeMesh& mesh, const VertexRings& rings, int passes) {
  constexpr int first = 5;  // passes: enough for good triangles, too few for threads to thin out
  constexpr float farthest = 0.35f;  // voxels; beyond it lie necks that would fold over
  const std::vector<V3f> raw = mesh.position;
  std::vector<V3f> smooth;
  filter_both(mesh.position, smooth, rings, passes_in_few(std::min(passes, first)),
              passes_in_few(passes));
  std::vector<V3f> normal = normals_of(mesh, rings);
  std::vector<float> lost(raw.size());
  for_each_vertex(raw.size(), [&](uint32_t v) { lost[v] = (raw[v] - smooth[v]).dot(normal[v]); });
  filter(lost, rings, passes_in_few(passes));
  for_each_vertex(raw.size(), [&](uint32_t v) {
    const float height = (smooth[v] - mesh.position[v]).dot(normal[v]) + lost[v];
    mesh.position[v] += normal[v] * std::clamp(height, -farthest, farthest);
  });
  return normal;
}

/// Of the triangles around v makes the ring of its neighbours.
void order_ring(const LatticeMesh& mesh, uint32_t v, std::span<uint32_t> ring,
                std::vector<std::array<uint32_t, 2>>& side) {
  const auto edge_from = [&](uint32_t t) {  // the side of triangle t across from v
    const Triangle& triangle = mesh.triangle[t];
    const int k = triangle.x == v ? 0 : triangle.y == v ? 1 : 2;
    return std::array{triangle[(k + 1) % 3], triangle[(k + 2) % 3]};
  };
  side.resize(ring.size());
  std::transform(ring.begin(), ring.end(), side.begin(), edge_from);
  std::swap(side[0], *std::min_element(side.begin(), side.end()));
  for (size_t k = 0; k + 1 < side.size(); ++k) {
    const auto next = std::find_if(side.begin() + ptrdiff_t(k) + 1, side.end(),
                                   [&](const auto& s) { return s[0] == side[k][1]; });
    if (next != side.end()) std::swap(side[k + 1], *next);
  }
  std::transform(side.begin(), side.end(), ring.begin(), [](const auto& s) { return s[0]; });
}

}  // namespace

VertexRings rings_of(const LatticeMesh& mesh) {
  const size_t vertices = mesh.position.size();
  VertexRings rings;
  rings.first.assign(vertices + 1, 0);
  for_each_vertex(mesh.triangle.size(), [&](uint32_t t) {
    for (int k = 0; k < 3; ++k)
      std::atomic_ref(rings.first[mesh.triangle[t][k] + 1]).fetch_add(1, std::memory_order_relaxed);
  });
  for (size_t v = 0; v < vertices; ++v) rings.first[v + 1] += rings.first[v];
  rings.neighbour.resize(rings.first[vertices]);  // of triangles, to begin with
  std::vector<uint32_t> next(rings.first.begin(), rings.first.end() - 1);
  for_each_vertex(mesh.triangle.size(), [&](uint32_t t) {
    for (int k = 0; k < 3; ++k)
      rings.neighbour[std::atomic_ref(next[mesh.triangle[t][k]])
                          .fetch_add(1, std::memory_order_relaxed)] = t;
  });
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, static_cast<uint32_t>(vertices), 2048),
                    [&](const auto& range) {
                      std::vector<std::array<uint32_t, 2>> side;
                      for (uint32_t v = range.begin(); v < range.end(); ++v)
                        order_ring(mesh, v,
                                   {rings.neighbour.begin() + rings.first[v],
                                    rings.neighbour.begin() + rings.first[v + 1]},
                                   side);
                    });
  return rings;
}

Components components_of(const LatticeMesh& mesh) {
  const size_t vertices = mesh.position.size();
  std::vector<std::atomic<uint32_t>> parent(vertices);
  for_each_vertex(vertices, [&](uint32_t v) { parent[v].store(v, std::memory_order_relaxed); });
  for_each_vertex(mesh.triangle.size(), [&](uint32_t t) {
    join(parent, mesh.triangle[t][0], mesh.triangle[t][1]);
    join(parent, mesh.triangle[t][0], mesh.triangle[t][2]);
  });
  std::vector<uint32_t> part(vertices), count;
  for (uint32_t v = 0; v < vertices; ++v) {
    const uint32_t root = root_of(parent, v);  // at most v: numbered already
    if (root == v) {
      part[v] = static_cast<uint32_t>(count.size());
      count.push_back(0);
    }
    part[v] = part[root];
    ++count[part[v]];
  }
  Components parts;
  parts.first.resize(count.size() + 1);
  for (size_t c = 0; c < count.size(); ++c) parts.first[c + 1] = parts.first[c] + count[c];
  parts.vertex.resize(vertices);
  std::vector<uint32_t> next(parts.first.begin(), parts.first.end() - 1);
  for (uint32_t v = 0; v < vertices; ++v) parts.vertex[next[part[v]]++] = v;
  return parts;
}

std::vector<double> volumes_of(const LatticeMesh& mesh, const VertexRings& rings,
                               const Components& parts) {
  std::vector<double> volume(parts.size());
  tbb::parallel_for(size_t{0}, parts.size(),
                    [&](size_t c) { volume[c] = volume_of(mesh, rings, parts, c); });
  return volume;
}

std::vector<V3f> normals_of(const LatticeMesh& mesh, const VertexRings& rings) {
  std::vector<V3f> normal(mesh.position.size());
  for_each_vertex(normal.size(),
                  [&](uint32_t v) { normal[v] = unit_or_up(normal_times_area(mesh, rings, v)); });
  return normal;
}

void smooth_normals(std::vector<V3f>& normal, const VertexRings& rings, int passes) {
  if (passes > 0 && !normal.empty()) filter(normal, rings, passes_in_few(passes));
  for_each_vertex(normal.size(), [&](uint32_t v) { normal[v] = unit_or_up(normal[v]); });
}

void smooth_mesh(LatticeMesh& mesh, const VertexRings& rings, const Components& parts, int passes) {
  if (passes == 0 || mesh.position.empty()) return;
  const std::vector<double> wanted = volumes_of(mesh, rings, parts);
  std::vector<V3f> normal = remove_bumps(mesh, rings, passes);
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t c) {
    constexpr uint32_t drop = 1000;  // vertices; scaling suits a compact part of any shape
    if (parts.first[c + 1] - parts.first[c] > drop)
      return shift_part(mesh, rings, parts, c, wanted[c], normal);
    // A cavity has a negative volume.
    const double kept = volume_of(mesh, rings, parts, c) / wanted[c];
    if (kept > 0.01) scale_part(mesh, parts, c, 1 / kept);
  });
}

}  // namespace drench::surfacing
