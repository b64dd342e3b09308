#include "sim/passes/cloth/wet_cloth.h"

#include "sim/neighbours/grid.h"
#include "sim/passes/cloth/shell_system.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// What a vertex is made of.
struct WetVertices {
  const WetLaw* law;  // of a sheet
  const int *sheet, *fan_start, *fan_entry;

  DRENCH_HD int sheet_of(int i) const { return sheet[fan_entry[fan_start[i]] / 3]; }
  DRENCH_HD const WetLaw& of(int i) const { return law[sheet_of(i)]; }
};

WetVertices wet_vertices_of(const State& state) {
  const ClothState& c = state.cloth;
  return {state.wet.law.data(), c.sheet.data(), c.fan_start.data(), c.fan_entry.data()};
}

/// The particle that is nearest to a place, of those within a spacing; -1: none.
struct Touching {
  GridView grid;
  ConstVecView position;
  float spacing;

  DRENCH_HD int nearest(Vec3<float> x) const {
    float least = spacing * spacing;
    int found = -1;
    const GridShape& g = grid.shape;
    const Vec3<float> in{home(x.x, g.origin.x, g.period.x), home(x.y, g.origin.y, g.period.y),
                         home(x.z, g.origin.z, g.period.z)};
    for_each_run(grid, g.cell_x(in.x), g.cell_y(in.y), g.cell_z(in.z),
                 [&](int begin, int end, Vec3<float> shift) {
                   for (int j = begin; j < end; ++j) {
                     const float d2 = length2(position[j] + shift - in);
                     if (d2 <= least) least = d2, found = j;
                   }
                 });
    return found;
  }
  /// Sheets are not wrapped, particles are.
  static DRENCH_HD float home(float x, float low, float period) {
    return period > 0.f ? x - period * floorf((x - low) / period) : x;
  }
};

/// Soaks or dries a vertex.
struct Soaking {
  WetVertices vertices;
  Touching touching;
  ConstVecView position, particle_velocity;
  VecView velocity, left;
  const float* inverse_mass;
  float* wetness;
  float dt;
  bool fluid;

  DRENCH_HD void operator()(int i) const {
    const WetLaw& law = vertices.of(i);
    const float w = wetness[i];
    const bool may_soak = law.soaks && w<1.f, may_dry = law.dry_time> 0.f && w > 0.f;
    if (law.uptake == 0.f || !(may_soak || may_dry)) return;
    const int particle = fluid ? touching.nearest(position[i]) : -1;
    if (particle < 0) {
      if (may_dry) wetness[i] = w * law.dry_time / (law.dry_time + dt);
      return;
    }
    if (!may_soak) return;
    const float wetter = minimum((w * law.soak_time + dt) / (law.soak_time + dt), 1.f);
    wetness[i] = wetter;
    if (inverse_mass[i] == 0.f) return;
    const float taken = law.uptake * (wetter - w) / (1.f + law.uptake * wetter);
    const Vec3<float> v = velocity[i], gain = (particle_velocity[particle] - v) * taken;
    // Shells take a velocity that differs from `left` for that of a vertex that something stopped.
    if (length2(v - left[i]) == 0.f) left.set(i, v + gain);
    velocity.set(i, v + gain);
  }
};

/// Of a sheet, by mass.
struct MeanWetness {
  double water = 0, mass = 0;
  DRENCH_HD MeanWetness operator+(const MeanWetness& other) const {
    return {water + other.water, mass + other.mass};
  }
};

void weigh(State& state) {
  const WetVertices vertices = wet_vertices_of(state);
  const float *wetness = state.wet.wetness.data(), *dry_mass = state.wet.dry_mass.data();
  float *mass = state.cloth.mass.data(), *inverse_mass = state.cloth.inverse_mass.data();
  SheetVertex* contact = state.self_contact.any ? state.self_contact.vertex.data() : nullptr;
  parallel_for(
      state.queue, "wet: masses", state.cloth.vertices, DRENCH_LAMBDA(int i) {
        const WetLaw& law = vertices.of(i);
        const float w = wetness[i], m = dry_mass[i] * (1.f + law.uptake * w);
        mass[i] = m;
        if (inverse_mass[i] > 0.f) inverse_mass[i] = 1.f / m;
        if (contact)
          contact[i].root_friction =
              square_root(law.friction + (law.wet_friction - law.friction) * w);
      });
}

/// Of every sheet: its stiffness over that of the dry one.
void find_softness(State& state) {
  const WetVertices vertices = wet_vertices_of(state);
  const float *wetness = state.wet.wetness.data(), *dry_mass = state.wet.dry_mass.data();
  float* softness = state.wet.softness.data();
  for (const VertexRange& sheet : state.wet.sheets) {
    const int first = sheet.first;
    reduce_then(
        state.queue, "wet: mean", sheet.count, MeanWetness{},
        DRENCH_LAMBDA(int k) {
          const double m = dry_mass[first + k];
          return MeanWetness{m * wetness[first + k], m};
        },
        Plus{},
        DRENCH_LAMBDA(const MeanWetness& mean) {
          const float stiffness = vertices.of(first).stiffness;
          softness[vertices.sheet_of(first)] =
              float(1 + (double(stiffness) - 1) * mean.water / mean.mass);
        });
  }
}

void soften_bending(State& state) {
  ShellState& s = state.shell;
  const WetVertices vertices = wet_vertices_of(state);
  const float *softness = state.wet.softness.data(), *dry = state.wet.dry_bend.data();
  const ShellRows rows = shell_rows_of(s);
  float* bend = s.bend.data();
  const bool joined = state.cloth.joined;
  const ConstVecView dry_push = state.wet.dry_push.view();
  const VecView push = s.push.view();
  parallel_for(
      state.queue, "wet: bending", state.cloth.vertices, DRENCH_LAMBDA(int i) {
        const float soft = softness[vertices.sheet_of(i)];
        const int slice = ShellRows::slice(i);
        for (int slot = rows.row_start[slice]; slot < rows.row_start[slice + 1]; ++slot) {
          const int at = ShellRows::entry(slot, i);
          bend[at] = dry[at] * soft;
        }
        if (joined) push.set(i, dry_push[i] * soft);
      });
}

void soften_moduli(State& state) {
  ShellState& s = state.shell;
  const float *softness = state.wet.softness.data(), *dry = state.wet.dry_law.data();
  float* law = s.law.data();
  const int sheets = s.sheets;
  parallel_for(
      state.queue, "wet: moduli", sheets, DRENCH_LAMBDA(int k) {
        const auto soften = [&](int field) {
          law[field * sheets + k] = dry[field * sheets + k] * softness[k];
        };
        for (int field = 0; field < 4; ++field) soften(field);
        for (int field = rigidity_field; field < rigidity_field + 4; ++field) soften(field);
      });
}

template <class T>
void copy(Column<T>& to, const Column<T>& from) {
  from_host(to, to_host(from, from.size()));
}

}  // namespace

void soak_sheets(State& state) {
  const ClothState& c = state.cloth;
  const FluidState& f = state.fluid;
  const Soaking soak{
      .vertices = wet_vertices_of(state),
      .touching = {{f.grid, f.cell_start.data()}, f.position.view(), state.parameters.spacing},
      .position = c.position.view(),
      .particle_velocity = f.velocity.view(),
      .velocity = state.cloth.velocity.view(),
      .left = state.shell.left.view(),
      .inverse_mass = c.inverse_mass.data(),
      .wetness = state.wet.wetness.data(),
      .dt = float(state.dt),
      .fluid = f.count > 0};
  parallel_for(
      state.queue, "wet: soak", c.vertices, DRENCH_LAMBDA(int i) { soak(i); });
  apply_wetness(state);
}

void apply_wetness(State& state) {
  weigh(state);
  find_softness(state);
  soften_bending(state);
  soften_moduli(state);
}

void load_wet_cloth(State& state, const ClothTopology& cloth) {
  WetState& w = state.wet;
  const ShellState& s = state.shell;
  w.any = !cloth.wet.empty();
  if (!w.any) return;
  from_host(w.law, cloth.wet);
  from_host(w.softness, std::vector<float>(cloth.wet.size(), 1.f));
  w.sheets = sheet_ranges(cloth);
  w.wetness.resize(state.cloth.padded);
  copy(w.dry_mass, state.cloth.mass);
  copy(w.dry_law, s.law), copy(w.dry_bend, s.bend);
  copy(w.dry_push.x, s.push.x), copy(w.dry_push.y, s.push.y), copy(w.dry_push.z, s.push.z);
}

}  // namespace drench::sim::DRENCH_BACKEND
