#include "tests/sim/shell_sheets.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

namespace drench::sim_tests {

namespace {

using Column = std::vector<int>;  // vertices by rising y

std::vector<double> heights(SheetMesh mesh, double width, int cells, bool odd) {
  std::vector<double> y;
  const double cell = width / cells;
  if (mesh == SheetMesh::equilateral && odd) {
    y.push_back(0);
    for (int j = 0; j < cells; ++j) y.push_back((j + 0.5) * cell);
    y.push_back(width);
  } else {
    for (int j = 0; j <= cells; ++j) y.push_back(j * cell);
  }
  return y;
}

/// Triangles between two columns of vertices, the lower next vertex first; of two that are level
/// that of the left column where `left_first`.
void fill_between(sim::ShellSurface& s, const Column& left, const Column& right, int column,
                  SheetMesh mesh) {
  size_t i = 0, j = 0;
  while (i + 1 < left.size() || j + 1 < right.size()) {
    const double yl = i + 1 < left.size() ? s.rest[left[i + 1]].y : 1e30,
                 yr = j + 1 < right.size() ? s.rest[right[j + 1]].y : 1e30;
    const bool level = std::abs(yl - yr) < 1e-9;
    const bool up_left =
        level ? i == j && (mesh != SheetMesh::union_jack || (int(i) + column) % 2 == 0) : yl < yr;
    if (up_left) {
      s.triangle.push_back({left[i], right[j], left[i + 1]}), ++i;
    } else {
      s.triangle.push_back({left[i], right[j], right[j + 1]}), ++j;
    }
  }
}

double angle_at(const V3d& at, const V3d& a, const V3d& b) {
  const V3d u = a - at, v = b - at;
  return std::atan2(u.cross(v).length(), u.dot(v));
}

/// Turns sides about until the triangles are Delaunay's.
void make_delaunay(sim::ShellSurface& s) {
  for (bool turned = true; turned;) {
    turned = false;
    find_neighbours(s);
    std::vector<char> touched(s.triangle.size(), 0);
    for (int t = 0; t < int(s.triangle.size()); ++t) {
      for (int k = 0; k < 3; ++k) {
        const int n = s.neighbour[t][k];
        if (n < 0 || touched[t] || touched[n]) continue;
        const int a = s.triangle[t][k], b = s.triangle[t][(k + 1) % 3],
                  c = s.triangle[t][(k + 2) % 3];
        int d = -1;
        for (const int v : s.triangle[n])
          if (v != a && v != b) d = v;
        if (angle_at(s.rest[c], s.rest[a], s.rest[b]) + angle_at(s.rest[d], s.rest[a], s.rest[b]) <=
            M_PI + 1e-9)
          continue;
        s.triangle[t] = {c, a, d}, s.triangle[n] = {c, d, b};
        touched[t] = touched[n] = 1, turned = true;
      }
    }
  }
}

}  // namespace

void find_neighbours(sim::ShellSurface& s) {
  std::map<std::pair<int, int>, int> at;
  for (int t = 0; t < int(s.triangle.size()); ++t)
    for (int k = 0; k < 3; ++k) at[{s.triangle[t][k], s.triangle[t][(k + 1) % 3]}] = t;
  s.neighbour.assign(s.triangle.size(), {-1, -1, -1});
  for (int t = 0; t < int(s.triangle.size()); ++t) {
    for (int k = 0; k < 3; ++k) {
      const auto found = at.find({s.triangle[t][(k + 1) % 3], s.triangle[t][k]});
      if (found != at.end()) s.neighbour[t][k] = found->second;
    }
  }
}

sim::ShellSurface flat_sheet(SheetMesh mesh, const SheetSize& size) {
  sim::ShellSurface s;
  const double cell = size.length / size.cells;
  const double pitch = mesh == SheetMesh::equilateral ? cell * 2 / std::sqrt(3.) : cell;
  const int across = std::max(1, int(std::lround(size.width / pitch)));
  std::mt19937 random(unsigned(size.seed));
  const auto jitter = [&] { return (double(random()) / 4294967296.0 - 0.5) * 0.6 * cell; };
  std::vector<Column> column;
  for (int i = -size.behind; i <= size.cells; ++i) {
    Column vertices;
    for (const double y : heights(mesh, size.width, across, i & 1)) {
      vertices.push_back(int(s.rest.size()));
      s.rest.push_back({i * cell, y, 0});
    }
    column.push_back(vertices);
  }
  for (size_t i = 0; i + 1 < column.size(); ++i)
    fill_between(s, column[i], column[i + 1], int(i), mesh);
  if (mesh == SheetMesh::unstructured) {
    for (V3d& x : s.rest) {
      const double dx = jitter(), dy = jitter();
      const double still = (size.still + 0.5) * cell;
      if (x.x < cell / 2) continue;
      const bool inner =
          x.x > still && x.y > still && x.x < size.length - still && x.y < size.width - still;
      if (size.still > 0 && !inner) continue;
      if (x.x < size.length - cell / 2) x.x += dx;
      if (x.y > cell / 2 && x.y < size.width - cell / 2) x.y += dy;
    }
    make_delaunay(s);
  }
  find_neighbours(s);
  return s;
}

}  // namespace drench::sim_tests
