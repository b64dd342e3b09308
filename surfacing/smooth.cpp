#include "surfacing/smooth.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

namespace drench::surfacing {
namespace {

template <class F>
void for_each_vertex(size_t n, F f) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, n, 2048), [&](const auto& range) {
    for (size_t v = range.begin(); v < range.end(); ++v) f(static_cast<uint32_t>(v));
  });
}

/// Chebyshev coefficients over a in [-1, 1] of the filter 2 p^n - p^2n, p = (1 + a) / 2: n passes
/// forth and n over the displacement back. With a = cos(t) it falls as a Gaussian in t, so that few
/// passes make 2 n: 10 for 20, within 1e-3.
std::vector<float> forth_and_back(int n) {
  constexpr int samples = 512;
  constexpr double least = 1e-3;
  std::vector<float> coefficient;
  double left = 1;  // that the sum at a = 1, where all polynomials are 1, lacks
  for (int k = 0; std::abs(left) > least || k < 3; ++k) {
    double sum = 0;
    for (int s = 0; s < samples; ++s) {
      const double t = (s + 0.5) * std::numbers::pi / samples, p = 0.5 + 0.5 * std::cos(t);
      sum += (2 * std::pow(p, n) - std::pow(p, 2 * n)) * std::cos(k * t);
    }
    coefficient.push_back(static_cast<float>((k == 0 ? 1 : 2) * sum / samples));
    left -= coefficient.back();
  }
  coefficient[0] += static_cast<float>(left);  // what is constant stays
  return coefficient;
}

V3f mean_of_neighbours(const std::vector<V3f>& value, const VertexRings& rings, uint32_t v) {
  V3f sum(0);
  const uint32_t begin = rings.first[v], end = rings.first[v + 1];
  for (uint32_t k = begin; k < end; ++k) sum += value[rings.wing[k][0]];
  return sum / static_cast<float>(end - begin);
}

/// value = sum of coefficient[k] T_k(A) value, A the mean of the neighbours, T_k by their
/// recurrence.
void filter(std::vector<V3f>& value, const VertexRings& rings,
            const std::vector<float>& coefficient) {
  std::vector<V3f> before = value, now(value.size());
  for_each_vertex(value.size(), [&](uint32_t v) {
    now[v] = mean_of_neighbours(before, rings, v);
    value[v] = before[v] * coefficient[0] + now[v] * coefficient[1];
  });
  for (size_t k = 2; k < coefficient.size(); ++k) {
    for_each_vertex(value.size(), [&](uint32_t v) {
      before[v] = 2.f * mean_of_neighbours(now, rings, v) - before[v];
      value[v] += before[v] * coefficient[k];
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
  for (uint32_t k = rings.first[v]; k < rings.first[v + 1]; ++k)
    sum += (mesh.position[rings.wing[k][0]] - mesh.position[v])
               .cross(mesh.position[rings.wing[k][1]] - mesh.position[v]);
  return sum;
}

V3f unit_or_up(V3f v) {
  const float length = v.length();
  return length > 0 ? v / length : V3f(0, 1, 0);
}

/// Signed volume of a part, about one of its own vertices so that far parts keep their digits.
double volume_of(const LatticeMesh& mesh, const VertexRings& rings, const Components& parts,
                 size_t part) {
  const V3d about(mesh.position[parts.vertex[parts.first[part]]]);
  return sum_over<double>(parts, part, [&](uint32_t v) {
    const V3d p = V3d(mesh.position[v]) - about;
    double sum = 0;
    for (uint32_t k = rings.first[v]; k < rings.first[v + 1]; ++k)
      if (v < rings.wing[k][0] && v < rings.wing[k][1])  // each triangle once
        sum += p.dot((V3d(mesh.position[rings.wing[k][0]]) - about)
                         .cross(V3d(mesh.position[rings.wing[k][1]]) - about));
    return sum / 6;
  });
}

double area_of(const LatticeMesh& mesh, const VertexRings& rings, const Components& parts,
               size_t part) {
  return sum_over<double>(parts, part, [&](uint32_t v) {
    double sum = 0;
    for (uint32_t k = rings.first[v]; k < rings.first[v + 1]; ++k)
      sum += (mesh.position[rings.wing[k][0]] - mesh.position[v])
                 .cross(mesh.position[rings.wing[k][1]] - mesh.position[v])
                 .length();
    return sum / 6;  // half a cross product, and each triangle is met three times
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

/// Shifts a part along its normals to the wanted volume; two Newton steps, since the area follows.
void shift_part(LatticeMesh& mesh, const VertexRings& rings, const Components& parts, size_t part,
                double wanted) {
  for (int step = 0; step < 2; ++step) {
    const double missing = wanted - volume_of(mesh, rings, parts, part);
    const double area = area_of(mesh, rings, parts, part);
    const float shift = static_cast<float>(std::clamp(missing / area, -0.5, 0.5));
    std::vector<V3f> offset(parts.first[part + 1] - parts.first[part]);
    tbb::parallel_for(size_t{0}, offset.size(), [&](size_t k) {
      const uint32_t v = parts.vertex[parts.first[part] + k];
      offset[k] = shift * unit_or_up(normal_times_area(mesh, rings, v));
    });
    tbb::parallel_for(size_t{0}, offset.size(), [&](size_t k) {
      mesh.position[parts.vertex[parts.first[part] + k]] += offset[k];
    });
  }
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
  rings.wing.resize(rings.first[vertices]);
  std::vector<uint32_t> next(rings.first.begin(), rings.first.end() - 1);
  for_each_vertex(mesh.triangle.size(), [&](uint32_t t) {
    const Triangle& triangle = mesh.triangle[t];
    for (int k = 0; k < 3; ++k) {
      const uint32_t slot =
          std::atomic_ref(next[triangle[k]]).fetch_add(1, std::memory_order_relaxed);
      rings.wing[slot] = {triangle[(k + 1) % 3], triangle[(k + 2) % 3]};
    }
  });
  for_each_vertex(vertices, [&](uint32_t v) {  // threads took slots in any order
    std::sort(rings.wing.begin() + rings.first[v], rings.wing.begin() + rings.first[v + 1]);
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
  std::vector<V3f> before(normal.size());
  for (int pass = 0; pass < passes; ++pass) {
    before.swap(normal);
    for_each_vertex(normal.size(), [&](uint32_t v) {
      normal[v] = 0.5f * (before[v] + mean_of_neighbours(before, rings, v));
    });
  }
  for_each_vertex(normal.size(), [&](uint32_t v) { normal[v] = unit_or_up(normal[v]); });
}

void smooth_mesh(LatticeMesh& mesh, const VertexRings& rings, const Components& parts, int passes) {
  if (passes == 0 || mesh.position.empty()) return;
  const std::vector<double> wanted = volumes_of(mesh, rings, parts);
  const std::vector<V3f> raw = mesh.position;
  filter(mesh.position, rings, forth_and_back(passes));
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t c) {
    constexpr uint32_t drop = 1000;  // vertices; scaling suits a compact part of any shape
    if (parts.first[c + 1] - parts.first[c] > drop)
      return shift_part(mesh, rings, parts, c, wanted[c]);
    // A cavity has a negative volume; a part that collapsed is not smoothed at all.
    const double kept = volume_of(mesh, rings, parts, c) / wanted[c];
    if (kept > 0.01) return scale_part(mesh, parts, c, 1 / kept);
    for_each_member(parts, c, [&](uint32_t v) { mesh.position[v] = raw[v]; });
  });
}

}  // namespace drench::surfacing
