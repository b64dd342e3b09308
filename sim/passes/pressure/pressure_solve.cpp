#include "sim/passes/pressure/pressure_solve.h"

#include "sim/backend/solve_control.h"
#include "sim/passes/pressure/multilevel.h"

namespace drench::sim::DRENCH_BACKEND {

void restrict_nodes(State& state, int l, float* nodes) {
  const Hierarchy& h = state.pressure.hierarchy;
  const NodeLevel fine = h.level[l - 1], coarse = h.level[l];
  const int* awake = &state.pressure.control.data()->levels;
  parallel_for(
      state.queue, "levels: down", coarse.count(), DRENCH_LAMBDA(int n) {
        if (!*awake) return;
        const Vec3<int> at = coarse.place(n);
        float sum = 0.f;
        for_each_child(coarse.z, fine.z, at.z, [&](int z, float wz) {
          for_each_child(coarse.y, fine.y, at.y, [&](int y, float wy) {
            for_each_child(coarse.x, fine.x, at.x, [&](int x, float wx) {
              sum += wx * wy * wz * nodes[fine.first + fine.index(x, y, z)];
            });
          });
        });
        nodes[coarse.first + n] = sum;
      });
}

void prolong_nodes(State& state, int l, float* nodes) {
  const Hierarchy& h = state.pressure.hierarchy;
  const NodeLevel fine = h.level[l - 1], coarse = h.level[l];
  const int* awake = &state.pressure.control.data()->levels;
  parallel_for(
      state.queue, "levels: up", fine.count(), DRENCH_LAMBDA(int n) {
        if (!*awake) return;
        const Vec3<int> at = fine.place(n);
        const NodeAxis::Parents x = coarse.x.parents(at.x), y = coarse.y.parents(at.y),
                                z = coarse.z.parents(at.z);
        const float* v = nodes + coarse.first;
        const float sum = v[coarse.index(x.a, y.a, z.a)] + v[coarse.index(x.b, y.a, z.a)] +
                          v[coarse.index(x.a, y.b, z.a)] + v[coarse.index(x.b, y.b, z.a)] +
                          v[coarse.index(x.a, y.a, z.b)] + v[coarse.index(x.b, y.a, z.b)] +
                          v[coarse.index(x.a, y.b, z.b)] + v[coarse.index(x.b, y.b, z.b)];
        nodes[fine.first + n] += 0.125f * sum;
      });
}

void shape_levels(State& state) {
  Hierarchy& h = state.pressure.hierarchy;
  const GridShape& g = state.fluid.grid;
  const Vec3<int> wraps{g.period.x > 0.f, g.period.y > 0.f, g.period.z > 0.f};
  int shift = 1;  // as good as 0, for an eighth of the nodes
  const auto blocks = [&](int cells, int wrap) {
    return wrap ? cells : ((cells - 1) >> shift) + 1;
  };
  while (double(blocks(g.nx, wraps.x)) * blocks(g.ny, wraps.y) * blocks(g.nz, wraps.z) >
             state.fluid.count &&
         shift < 8)
    ++shift;
  h.shift = {wraps.x ? 0 : shift, wraps.y ? 0 : shift, wraps.z ? 0 : shift};
  h.blocks = {blocks(g.nx, wraps.x), blocks(g.ny, wraps.y), blocks(g.nz, wraps.z)};
  const auto axis = [](int blocks, int wraps, int shift, float inverse_edge) {
    return NodeAxis{wraps ? blocks : blocks + 1, wraps, 0, float(1 << shift) / inverse_edge};
  };
  const auto half = [](const NodeAxis& a) {
    if (a.n == 1) return NodeAxis{1, a.wraps, 0, a.edge};
    return NodeAxis{a.wraps ? (a.n + 1) / 2 : a.n == 2 ? 1 : a.n / 2 + 1, a.wraps, 1, 2 * a.edge};
  };
  NodeLevel level{axis(h.blocks.x, wraps.x, h.shift.x, g.inverse_edge.x),
                  axis(h.blocks.y, wraps.y, h.shift.y, g.inverse_edge.y),
                  axis(h.blocks.z, wraps.z, h.shift.z, g.inverse_edge.z), 0};
  h.levels = 0;
  for (;;) {
    h.level[h.levels++] = level;
    const int end = level.first + level.count();
    if (level.count() == 1 || h.levels == Hierarchy::most) {
      h.partial.resize(size_t(8) * h.blocks.x * h.blocks.y * h.blocks.z);
      h.answer.resize(end), h.inverse.resize(end);
      return;
    }
    level = {half(level.x), half(level.y), half(level.z), end};
  }
}

namespace {

/// Levels are for errors that are small and smooth. In fluid that an impact has crushed they are
/// neither, and what is free of the bound changes with every iteration: levels throw particles.
/// Nor do they know cloth, in whose folds pressures would grow without end
/// (docs/decisions/0004-where-levels-take-part.md).
void choose_levels(State& state) {
  constexpr float small = 0.02f;  // of the rest density, in the mean
  SolveControl* control = state.pressure.control.data();
  const float* source = state.pressure.source.data();
  const bool sheets = state.contact.near > 0;
  const double most = double(small) * state.parameters.rest_density * state.fluid.count;
  reduce_then(
      state.queue, "levels: error", state.fluid.count, 0.0,
      DRENCH_LAMBDA(int i) { return double(max0(source[i])); }, Plus{},
      DRENCH_LAMBDA(double sum) { control->levels = !sheets && sum <= most; });
}

/// Is there nothing to do on the levels? The GPU's host does not ask: launches do nothing there.
bool no_levels(const State& state) {
#if defined(__CUDACC__)
  return state.contact.near > 0;
#else
  return !state.pressure.control.data()->levels;
#endif
}

/// Shapes and stiffnesses of all levels, these with what invert_diagonal left.
void prepare_levels(State& state) {
  shape_levels(state);
  choose_levels(state);
  if (no_levels(state)) return;
  Hierarchy& h = state.pressure.hierarchy;
  float *inverse = h.inverse.data(), *uneven = h.answer.data();
  restrict_particles(state, inverse, SquaredDensity{state.fluid.density.data()});
  restrict_particles(state, uneven, EvenEnergy{state.pressure.next.data()});
  for (int l = 1; l < h.levels; ++l) {
    restrict_nodes(state, l, inverse), restrict_nodes(state, l, uneven);
  }
  for (int l = 0; l < h.levels; ++l) {
    const NodeLevel level = h.level[l];
    // of hats, over the integral of the function: of the slope's square along an axis, and of the
    // function's own square
    const auto bend = [](const NodeAxis& a) { return a.n == 1 ? 0.f : 2.f / (a.edge * a.edge); };
    const auto mean = [](const NodeAxis& a) { return a.n == 1 ? 1.f : 2.f / 3.f; };
    const float smooth = bend(level.x) * mean(level.y) * mean(level.z) +
                         mean(level.x) * bend(level.y) * mean(level.z) +
                         mean(level.x) * mean(level.y) * bend(level.z);
    constexpr float part = 0.3f;  // of a node's own step, as levels overlap
    parallel_for(
        state.queue, "levels: stiffness", level.count(), DRENCH_LAMBDA(int n) {
          const int at = level.first + n;
          const float stiffness = smooth * inverse[at] + uneven[at];
          inverse[at] = stiffness > 0.f ? part / stiffness : 0.f;
        });
  }
}

/// z on the nodes of the finest level.
void correct_on_levels(State& state, const FreeGradient& gradient) {
  if (no_levels(state)) return;
  Hierarchy& h = state.pressure.hierarchy;
  float* answer = h.answer.data();
  const float* inverse = h.inverse.data();
  restrict_particles(state, answer, gradient);
  for (int l = 1; l < h.levels; ++l) restrict_nodes(state, l, answer);
  const int all = h.level[h.levels - 1].first + h.level[h.levels - 1].count();
  parallel_for(
      state.queue, "levels: scale", all, DRENCH_LAMBDA(int n) { answer[n] *= inverse[n]; });
  for (int l = h.levels - 1; l > 0; --l) prolong_nodes(state, l, answer);
}

/// A fluid without a free surface has nowhere to go: its mean density is what it is (the kernel's
/// sum over particles out of order is above rest), and no pressure changes it. What pressures can
/// do is to make it even. Against rest density they would rise without end: Taylor and Green's
/// vortices decay three times as much too fast (docs/decisions/0005-closed-domain.md).
void remove_mean(State& state) {
  PressureState& s = state.pressure;
  SolveControl* control = s.control.data();
  float* source = s.source.data();
  const int n = state.fluid.count;
  reduce_then(
      state.queue, "solve: mean", n, 0.0, DRENCH_LAMBDA(int i) { return double(source[i]); },
      Plus{}, DRENCH_LAMBDA(double sum) { control->mean = float(sum / n); });
  parallel_for(
      state.queue, "solve: source", n, DRENCH_LAMBDA(int i) { source[i] -= control->mean; });
}

}  // namespace

void begin_solve(State& state) {
  SolveControl* control = state.pressure.control.data();
  parallel_for(
      state.queue, "solve: control", 1, DRENCH_LAMBDA(int) { *control = {}; });
}

void begin_next_solve(State& state) {
  SolveControl* control = state.pressure.control.data();
  parallel_for(
      state.queue, "solve: control", 1, DRENCH_LAMBDA(int) {
        const SolveControl first = *control;
        *control = {};
        control->spent = first.iterations, control->left = first.residual;
        control->peak = first.peak;
      });
}

void start_from_last_step(State& state) {
  Float4* place = state.pressure.place.data();
  float *term = state.fluid.pressure_term.data(), *before = state.pressure.before.data();
  const float dt2 = float(state.dt * state.dt);
  parallel_for(
      state.queue, "solve: warm start", state.fluid.count,
      DRENCH_LAMBDA(int i) { place[i].w = before[i] = dt2 * term[i]; });
}

void start_from_nothing(State& state) {
  Float4* place = state.pressure.place.data();
  float* before = state.pressure.before.data();
  parallel_for(
      state.queue, "solve: cold start", state.fluid.count,
      DRENCH_LAMBDA(int i) { place[i].w = before[i] = 0.f; });
}

void keep_pressures(State& state) {
  const Float4* place = state.pressure.place.data();
  float* term = state.fluid.pressure_term.data();
  SolveControl* control = state.pressure.control.data();
  const float inverse_dt2 = float(1 / (state.dt * state.dt)), rest = state.parameters.rest_density;
  reduce_then(
      state.queue, "solve: end", state.fluid.count, Two<double>{0., 0.},
      DRENCH_LAMBDA(int i) {
        term[i] = place[i].w * inverse_dt2;
        const double square = double(term[i]) * term[i];
        return Two<double>{square, square * square};
      },
      Plus{},
      DRENCH_LAMBDA(const Two<double>& sum) {
        control->peak = sum.a > 0 ? rest * float(sqrt(5. / 3. * sum.b / sum.a)) : 0.f;
      });
}

void find_pressures(State& state, float least) {
  PressureState& s = state.pressure;
  const int n = state.fluid.count, most_iterations = state.parameters.most_iterations;
  if (state.parameters.full) remove_mean(state);
  const bool sheets = state.contact.near > 0;
  if (sheets) start_cloth(state);
  prepare_levels(state);
  const FreeGradient gradient{.place = s.place.data(),
                              .product = s.product.data(),
                              .source = s.source.data(),
                              .inverse_diagonal = s.inverse_diagonal.data(),
                              .control = s.control.data(),
                              .least = least};
  const PressureIteration iteration{
      .place = s.place.data(),
      .before = s.before.data(),
      .next = s.next.data(),
      .source = s.source.data(),
      .inverse_diagonal = s.inverse_diagonal.data(),
      .product = s.product.data(),
      .control = s.control.data(),
      .tolerance = state.parameters.tolerance,
      .scale = 1.f / (float(n) * state.parameters.rest_density),
      .most_iterations = most_iterations,
      .on_levels = gradient,
      .finest = {state.fluid.grid, s.hierarchy.level[0], s.hierarchy.shift},
      .answer = s.hierarchy.answer.data()};
  for (int k = 0; !ended(s.control, k, most_iterations + 1); ++k) {  // the last one decides only
    accelerate_by_pressure(state);
    density_rate(state);
    if (sheets) {
      respond_cloth(state, k == 0 ? first_sweeps : next_sweeps, cloth_tolerance);
      subtract_cloth_rate(state);
    }
    correct_on_levels(state, gradient);
    reduce_then(
        state.queue, "solve: step", n, SolveSums{},
        DRENCH_LAMBDA(int i) { return iteration.step(i); }, Plus{},
        DRENCH_LAMBDA(const SolveSums& sums) { iteration.decide(sums); });
    parallel_for(
        state.queue, "solve: extrapolate", n, DRENCH_LAMBDA(int i) { iteration.extrapolate(i); });
  }
}

void solve_pressure(State& state) {
  if (state.fluid.count == 0) return;  // the last ones have just left an open domain
  begin_solve(state);
  start_from_last_step(state);
  find_pressures(state, no_pull);
  keep_pressures(state);
}

}  // namespace drench::sim::DRENCH_BACKEND
