#include <algorithm>
#include <numeric>

#include "sim/passes/cloth/cloth_levels.h"
#include "sim/solver.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// The vertices of sheets by aggregates of the finest level. Four that follow each other are near
/// each other, and four of these, but for the last.
struct Leaves {
  std::vector<int> vertex, start{0};

  void add_sheet(const HostVec& rest, const VertexRange& sheet) {
    const int last = sheet.first + sheet.count,
              leaves = (sheet.count + most_vertices - 1) / most_vertices;
    pad(leaves);
    vertex.resize(size_t(last));
    std::iota(vertex.begin() + sheet.first, vertex.end(), sheet.first);
    halve(rest, sheet.first, last, leaves);
  }

 private:
  /// No four of the next sheet are to share an aggregate with those before, but at levels on which
  /// it is one: by the size of all before it, fifty sheets would ask for more than any memory.
  void pad(int leaves) {
    int group = 1;
    const int before = int(start.size()) - 1;
    while (4 * group <= before && group < leaves) group *= 4;
    start.resize(size_t((before + group - 1) / group * group) + 1, start.back());
  }
  void halve(const HostVec& rest, int first, int last, int leaves) {
    if (leaves <= 1) return start.push_back(last);
    int left = 1;
    while (2 * left < leaves) left *= 2;
    const std::vector<float>* const axis[3] = {&rest.x, &rest.y, &rest.z};
    const auto by = [](const std::vector<float>& x) {
      return [&x](int a, int b) { return x[a] != x[b] ? x[a] < x[b] : a < b; };
    };
    const auto begin = vertex.begin() + first, end = vertex.begin() + last;
    int longest = 0;
    float most = -1.f;
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax_element(begin, end, by(*axis[k]));
      const float length = (*axis[k])[*high] - (*axis[k])[*low];
      if (length > most) most = length, longest = k;
    }
    const int middle = first + int(int64_t(last - first) * left / leaves);
    std::nth_element(begin, vertex.begin() + middle, end, by(*axis[longest]));
    halve(rest, first, middle, left), halve(rest, middle, last, leaves - left);
  }
};

/// Middles of the aggregates of all levels.
HostVec centres_of(const ClothLevels& s, const Leaves& leaves, const HostVec& rest) {
  HostVec centre;
  centre.x.resize(s.aggregates), centre.y.resize(s.aggregates), centre.z.resize(s.aggregates);
  const int leaf_count = int(leaves.start.size()) - 1;
  for (int l = 0; l < s.levels; ++l) {
    for (int a = 0; a < s.level[l].count; ++a) {
      const int first = leaves.start[std::min(a << 2 * l, leaf_count)],
                last = leaves.start[std::min((a + 1) << 2 * l, leaf_count)];
      Vec3<double> sum{0, 0, 0};
      for (int k = first; k < last; ++k) {
        const int v = leaves.vertex[k];
        sum = sum + Vec3<double>{rest.x[v], rest.y[v], rest.z[v]};
      }
      const double inverse = 1. / std::max(last - first, 1);
      const size_t at = size_t(s.level[l].first + a);
      centre.x[at] = float(sum.x * inverse), centre.y[at] = float(sum.y * inverse);
      centre.z[at] = float(sum.z * inverse);
    }
  }
  return centre;
}

void load_vectors(VecColumn& column, const HostVec& host) {
  from_host(column.x, host.x), from_host(column.y, host.y), from_host(column.z, host.z);
}

/// Slots of the finest aggregates, eight of these together.
void load_leaves(ClothLevels& s, const Leaves& leaves, int padded) {
  const int count = int(leaves.start.size()) - 1;
  const size_t slots = size_t(most_vertices) * ((count + 7) / 8 * 8);
  std::vector<int> leaf(size_t(padded), 0), vertex(slots, 0);
  std::vector<float> weight(slots, 0.f);
  for (int a = 0; a < count; ++a) {
    for (int k = leaves.start[a]; k < leaves.start[a + 1]; ++k) {
      const size_t at = size_t(ClothLevels::slot(a, k - leaves.start[a]));
      leaf[leaves.vertex[k]] = a, vertex[at] = leaves.vertex[k], weight[at] = 1.f;
    }
  }
  from_host(s.leaf, leaf), from_host(s.leaf_vertex, vertex), from_host(s.leaf_weight, weight);
}

/// Places of vertices from the centres of their finest aggregates, by vertices and by slots.
void load_local_places(ClothLevels& s, const HostVec& centre, const HostVec& rest) {
  const size_t slots = s.leaf_vertex.size(), padded = s.leaf.size();
  const std::vector<int> leaf = to_host(s.leaf, padded), vertex = to_host(s.leaf_vertex, slots);
  const auto load = [&](Column<float>& local, Column<float>& by_slot, const std::vector<float>& x,
                        const std::vector<float>& middle) {
    std::vector<float> of(padded), of_slot(slots);
    for (size_t v = 0; v < padded; ++v) of[v] = x[v] - middle[leaf[v]];
    for (size_t k = 0; k < slots; ++k) of_slot[k] = of[vertex[k]];
    from_host(local, of), from_host(by_slot, of_slot);
  };
  load(s.local.x, s.slot_local.x, rest.x, centre.x);
  load(s.local.y, s.slot_local.y, rest.y, centre.y);
  load(s.local.z, s.slot_local.z, rest.z, centre.z);
}

/// The coarsest level at which a vertex has a neighbour in another aggregate of the one before.
std::vector<int> reach_of(const ClothTopology& cloth, const std::vector<int>& leaf) {
  std::vector<int> reach(size_t(cloth.vertices()), 0);
  for (int v = 0; v < cloth.vertices(); ++v) {
    const auto meet = [&](int other) {
      reach[v] = std::max(reach[v], common_level(leaf[v], leaf[other]));
    };
    for (int e = cloth.spring_start[v]; e < cloth.spring_start[v + 1]; ++e)
      meet(cloth.spring_end[e]);
    for (int e = cloth.shell.row_start[v]; e < cloth.shell.row_start[v + 1]; ++e)
      meet(cloth.shell.column[e]);
  }
  return reach;
}

}  // namespace

void load_cloth_levels(State& state, const ClothTopology& cloth) {
  ClothLevels& s = state.cloth_levels;
  if (!state.shell.any) return;
  // From a sheet's first vertex: the bits are not to depend on where the shot stands.
  HostVec rest = cloth.rest;
  Leaves leaves;
  for (const VertexRange& sheet : sheet_ranges(cloth)) {
    for (std::vector<float>* x : {&rest.x, &rest.y, &rest.z}) {
      const float from = (*x)[sheet.first];
      for (int v = sheet.first; v < sheet.first + sheet.count; ++v) (*x)[v] -= from;
    }
    leaves.add_sheet(rest, sheet);
  }
  for (int count = int(leaves.start.size()) - 1; s.levels < ClothLevels::most;
       count = (count + 3) / 4) {
    s.level[s.levels++] = {s.aggregates, count};
    s.aggregates += (count + 7) / 8 * 8;
    if (count == 1) break;
  }
  load_leaves(s, leaves, state.cloth.padded);
  from_host(s.reach, reach_of(cloth, to_host(s.leaf, size_t(state.cloth.padded))));
  const HostVec centre = centres_of(s, leaves, rest);
  for (std::vector<float>* x : {&rest.x, &rest.y, &rest.z}) x->resize(state.cloth.padded);
  load_vectors(s.rest, rest), load_vectors(s.centre, centre);
  load_local_places(s, centre, rest);
  const size_t all = size_t(s.aggregates);
  s.partial.resize(sums * all), s.strain.resize((sums - sums_of_all) * all);
  s.held.resize(size_t(6) * cloth.vertices()), s.inverse.resize(inverse_entries * all);
  s.moment.resize(unknowns * all), s.answer.resize(unknowns * all);
}

}  // namespace drench::sim::DRENCH_BACKEND
