#include "sim/passes/cloth/shell_columns.h"

#include "sim/passes/cloth/shell_system.h"

#include <algorithm>

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// Triangles by fields, padded to a multiple of eight with triangles of no area.
void load_triangles(State& state, const ClothTopology& cloth) {
  ShellState& s = state.shell;
  const ShellTopology& t = cloth.shell;
  const int n = cloth.triangles(), padded = (n + 7) / 8 * 8;
  s.triangles = padded, s.sheets = int(t.law.size());
  std::vector<float> area(t.area), gradient(size_t(4) * padded, 0.f),
      law(shell_law_fields * t.law.size());
  std::vector<int> corner(size_t(3) * padded, 0), sheet(cloth.sheet);
  area.resize(padded, 0.f), sheet.resize(padded, 0);
  for (int k = 0; k < 4; ++k)
    std::copy(t.gradient[k].begin(), t.gradient[k].end(), gradient.begin() + k * padded);
  for (int k = 0; k < n; ++k)
    for (int c = 0; c < 3; ++c) corner[c * padded + k] = cloth.corner[3 * k + c];
  for (size_t k = 0; k < t.law.size(); ++k) {
    const ShellLaw& l = t.law[k];
    const float field[shell_law_fields] = {
        l.c11,          l.c22, l.c12, l.c66, l.limit_start, l.limit_stiffness,
        l.damping_time, l.d11, l.d22, l.d12, l.d66};
    for (size_t f = 0; f < shell_law_fields; ++f) law[f * t.law.size() + k] = field[f];
  }
  from_host(s.area, area), from_host(s.gradient, gradient), from_host(s.law, law);
  from_host(s.corner, corner), from_host(s.sheet, sheet);
  s.element.resize(size_t(shell_element_fields) * padded);
  if (!state.cloth.joined) return;
  std::vector<float> shift[3];
  const std::vector<float>* from[3] = {&cloth.corner_shift.x, &cloth.corner_shift.y,
                                       &cloth.corner_shift.z};
  for (int axis = 0; axis < 3; ++axis) {
    shift[axis].assign(size_t(2) * padded, 0.f);
    for (int k = 0; k < n; ++k)
      for (int c = 1; c < 3; ++c)
        shift[axis][size_t(c - 1) * padded + k] = (*from[axis])[3 * k + c] - (*from[axis])[3 * k];
  }
  from_host(s.edge_shift.x, shift[0]), from_host(s.edge_shift.y, shift[1]),
      from_host(s.edge_shift.z, shift[2]);
}

/// Rows of eight vertices slot by slot. A row that is shorter than others of its slice ends on
/// itself.
struct Slices {
  std::vector<int> ring_start{0}, row_start{0}, end, offset;
  std::vector<float> bend;

  void add(const ShellTopology& t, int first, int vertices) {
    int ring = 0, wide = 0;
    for (int v = first; v < std::min(first + 8, vertices); ++v) {
      ring = std::max(ring, t.ring[v]);
      wide = std::max(wide, t.row_start[v + 1] - t.row_start[v] - t.ring[v]);
    }
    const size_t base = end.size();
    for (int slot = 0; slot < ring + wide; ++slot)
      for (int lane = 0; lane < 8; ++lane) end.push_back(first + lane), bend.push_back(0.f);
    for (int v = first; v < std::min(first + 8, vertices); ++v) {
      for (int k = t.row_start[v]; k < t.row_start[v + 1]; ++k) {
        const int in_row = k - t.row_start[v];
        const int slot = in_row < t.ring[v] ? in_row : ring + in_row - t.ring[v];
        const size_t at = base + 8 * size_t(slot) + size_t(v - first);
        end[at] = t.column[k], bend[at] = t.bend[k];
      }
    }
    for (size_t at = base; at < end.size(); at += 8) {
      bool same = true;
      for (int lane = 0; lane < 8; ++lane)
        same &= end[at + size_t(lane)] - first - lane == end[at] - first;
      offset.push_back(same ? end[at] - first : 0);
    }
    ring_start.push_back(ring_start.back() + ring);
    row_start.push_back(row_start.back() + ring + wide);
  }
};

/// Where in the rows of its corners the other two of a triangle stand.
std::vector<int> fan_slots(const ClothTopology& cloth, const Slices& slices) {
  const ShellTopology& t = cloth.shell;
  std::vector<int> slot;
  for (int v = 0; v < cloth.vertices(); ++v) {
    for (int e = cloth.fan_start[v]; e < cloth.fan_start[v + 1]; ++e) {
      const int k = cloth.fan_entry[e] / 3, c = cloth.fan_entry[e] % 3;
      for (int other = 1; other < 3; ++other) {
        const int to = cloth.corner[3 * k + (c + other) % 3];
        const auto begin = t.column.begin() + t.row_start[v], end = begin + t.ring[v];
        const auto found = std::find(begin, end, to);
        slot.push_back(found == end ? -1 : slices.ring_start[v / 8] + int(found - begin));
      }
    }
  }
  return slot;
}

/// Patches of eight triangles slot by slot, and where they stand by vertex. One that is shorter
/// than others of its slice ends on nodes of no weight.
struct PatchSlices {
  std::vector<int> start{0}, node, of_start{0}, of, of_triangle;
  std::vector<float> weight[3];

  PatchSlices(const PatchTopology& p, int triangles, int vertices) {
    std::vector<std::vector<std::pair<int, int>>> in(static_cast<size_t>(vertices));
    for (int first = 0; first < triangles; first += 8) {
      const int last = std::min(first + 8, triangles);
      int slots = 0;
      for (int t = first; t < last; ++t) slots = std::max(slots, p.start[t + 1] - p.start[t]);
      const int base = int(node.size());
      node.resize(size_t(base + 8 * slots), 0);
      for (std::vector<float>& w : weight) w.resize(node.size(), 0.f);
      for (int t = first; t < last; ++t) {
        for (int k = p.start[t]; k < p.start[t + 1]; ++k) {
          const int at = base + 8 * (k - p.start[t]) + t - first;
          node[at] = p.node[k];
          for (int c = 0; c < 3; ++c) weight[c][at] = p.weight[c][k];
          in[p.node[k]].emplace_back(at, t);
        }
      }
      start.push_back(start.back() + slots);
    }
    for (const auto& entries : in) {
      for (const auto& [at, t] : entries) of.push_back(at), of_triangle.push_back(t);
      of_start.push_back(int(of.size()));
    }
  }
};

void load_patches(State& state, const ClothTopology& cloth) {
  const PatchTopology& p = cloth.shell.patch;
  ShellState& s = state.shell;
  s.patches = p.used, s.curved = p.curved;
  if (!s.patches) return;
  const PatchSlices slices(p, cloth.triangles(), cloth.vertices());
  std::vector<float> weight, rest(size_t(3) * s.triangles, 0.f);
  for (int c = 0; c < 3; ++c) {
    weight.insert(weight.end(), slices.weight[c].begin(), slices.weight[c].end());
    std::copy(p.rest[c].begin(), p.rest[c].end(), rest.begin() + c * s.triangles);
  }
  s.patch_entries = int(slices.node.size());
  from_host(s.patch_start, slices.start), from_host(s.patch_node, slices.node);
  from_host(s.patch_weight, weight), from_host(s.patch_rest, rest);
  from_host(s.patch_of_start, slices.of_start), from_host(s.patch_of, slices.of);
  from_host(s.patch_of_triangle, slices.of_triangle);
  s.moment.resize(3 * s.triangles);
  if (!state.cloth.joined) return;
  const auto by_field = [&](const std::vector<float>& shift) {
    std::vector<float> fields(size_t(3) * s.triangles, 0.f);
    for (size_t k = 0; k < shift.size(); ++k) fields[k % 3 * s.triangles + k / 3] = shift[k];
    return fields;
  };
  from_host(s.patch_shift.x, by_field(p.shift_x)), from_host(s.patch_shift.y, by_field(p.shift_y)),
      from_host(s.patch_shift.z, by_field(p.shift_z));
}

}  // namespace

void load_shell(State& state, const ClothTopology& cloth) {
  const ShellTopology& t = cloth.shell;
  ShellState& s = state.shell;
  s.any = t.any();
  if (!s.any) return;
  load_triangles(state, cloth);
  Slices slices;
  for (int first = 0; first < cloth.vertices(); first += 8) slices.add(t, first, cloth.vertices());
  s.ring_slots = slices.ring_start.back();
  from_host(s.ring_start, slices.ring_start), from_host(s.row_start, slices.row_start);
  from_host(s.end, slices.end), from_host(s.offset, slices.offset), from_host(s.bend, slices.bend);
  from_host(s.fan_slot, fan_slots(cloth, slices));
  load_patches(state, cloth);
  const size_t entries = size_t(8) * s.ring_slots, padded = state.cloth.padded;
  s.block.resize(9 * entries), s.tension.resize(entries), s.diagonal.resize(6 * padded);
  s.bend_factor.resize(padded);
  for (VecColumn* v : {&s.path, &s.about, &s.from, &s.base, &s.landed, &s.rounding, &s.left,
                       &s.lost, &s.acceleration, &s.friction, &s.internal})
    v->resize(padded);
  if (!state.cloth.joined) return;
  for (auto [column, host] : {std::pair(&s.push.x, &t.push_x), std::pair(&s.push.y, &t.push_y),
                              std::pair(&s.push.z, &t.push_z)})
    from_host(*column, *host);
}

}  // namespace drench::sim::DRENCH_BACKEND
