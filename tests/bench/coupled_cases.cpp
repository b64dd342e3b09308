// Case coupled_momentum: what water and a free sheet lose of their momentum. Cases sheet_pool and
// strip_pool: a pool on a pinned sheet of light cotton, of springs and as a shell, against its own
// static solution (tests/validation/coupled.h, strip_pool.h), run time against error.

#include <cmath>
#include <string>
#include <vector>

#include "tests/bench/bench.h"
#include "tests/validation/coupled.h"
#include "tests/validation/strip_pool.h"

namespace drench::bench {
namespace {

void add(Line& line, const validation::PinnedPool& pool) { line.more["volume"] = pool.volume; }
void add(Line& line, const validation::StripPool& pool) {
  line.more["shape"] = pool.shape, line.more["spread_m"] = pool.spread;
}

/// What a pool on springs and one on a shell have in common, of runs that follow each other.
template <class Run>
void both_models(const Emit& emit, const std::vector<int>& resolutions, const Run& run) {
  for (const int across : resolutions) {
    for (const ClothModel model : {ClothModel::springs, ClothModel::shell}) {
      decltype(run(across, model)) pool;
      Line line;
      line.cost = measure([&] { pool = run(across, model); });
      line.method = model == ClothModel::shell ? "shell" : "springs";
      line.resolution = std::to_string(across) + " across, " + std::to_string(pool.particles);
      line.error = std::abs(pool.sag / pool.static_sag - 1), line.gate = 0.05;
      line.error_of = "sag over that of the same sheet under the hydrostatic load, less 1";
      line.more["sag_m"] = pool.sag, line.more["speed_m_s"] = pool.speed;
      line.more["steps"] = pool.steps;
      line.more["iterations_a_step"] = pool.iterations, line.more["sweeps_a_step"] = pool.sweeps;
      add(line, pool);
      emit(line);
    }
  }
}

void pools(const Emit& emit) {
  both_models(emit, sizes({15, 20, 30}, 2), [](int across, ClothModel model) {
    return validation::pinned_pool(across, 1, 0.2, model);
  });
}

void strips(const Emit& emit) {
  both_models(emit, sizes({15, 20, 30, 45}, 2), [](int across, ClothModel model) {
    return validation::strip_pool(across, 1, model);
  });
}

void momentum(const Emit& emit) {
  for (const int across : {8, 12, 16}) {
    validation::CoupledMomentum result;
    Line line;
    line.cost = measure([&] { result = validation::coupled_momentum(across, 1000); });
    line.method = "incompressible, strong coupling, 1000 steps";
    line.resolution = std::to_string(across) + " across, " + std::to_string(result.particles);
    line.error = result.drift, line.gate = 1e-5;
    line.error_of = "momentum of fluid and sheet, |p - p_0| over sum m max(speed, sqrt(g H))";
    line.more["given_kg_m_s"] = result.given;
    emit(line);
  }
}

const Registration coupled_momentum{"coupled_momentum",
                                    "momentum of a block of water and the free sheet that it hits",
                                    momentum, InQuick::yes};

const Registration strip_pool{
    "strip_pool", "a pool on a sheet that spans a periodic axis: time and error of the sag", strips,
    InQuick::yes};

const Registration sheet_pool{"sheet_pool", "a pool on a pinned sheet: time and error of the sag",
                              pools, InQuick::yes};

}  // namespace
}  // namespace drench::bench
