// What chance makes of shots, states and scenes. A seed makes a case; one that fails prints it, and
// DRENCH_STRESS_SEED=n runs that one alone.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <iostream>

#include "pipeline/contract/error.h"
#include "pipeline/contract/shot/shot_file.h"
#include "sim/simulator.h"
#include "tests/stress/chance.h"
#include "tests/stress/report.h"
#include "tests/stress/scenes.h"

namespace drench::stress_tests {
namespace {

// --- Numbers of a shot --------------------------------------------------------------------------

/// Every number between two '@' may become another.
constexpr const char* numbers = R"([shot]
frames = [@1001@, 1003]
fps = @24.0@
preroll = @0.0@
seed = @1@
gravity = [@0.0@, @-9.81@, @0.0@]
time_step = @0.0@
[domain]
min = [@-0.3@, @-0.2@, @-0.3@]
max = [@0.3@, @0.6@, @0.3@]
[domain.wall_velocity]
y_low = [@0.0@, 0.0, @0.0@]
[fluid]
solver = "SOLVER"
spacing = @0.02@
support_ratio = @0.0@
tolerance = @1e-4@
xsph = @0.01@
rest_density = @1000.0@
kinematic_viscosity = @1e-6@
surface_tension = @0.0@
artificial_viscosity = @0.1@
sound_speed = @0.0@
[[fluid.box]]
min = [@-0.1@, @0.1@, @-0.1@]
max = [@0.1@, @0.2@, @0.1@]
velocity = [@0.0@, @-1.0@, @0.0@]
[[fluid.sphere]]
center = [@0.0@, @0.4@, @0.0@]
radius = @0.06@
velocity = [@0.0@, @0.0@, @0.0@]
[[fluid.emitter]]
center = [@0.2@, @0.5@, @0.0@]
direction = [@0.0@, @-1.0@, @0.0@]
radius = @0.03@
speed = @1.0@
start = @0.0@
stop = @1.0@
[[fluid.drops]]
min = [@-0.2@, @0.5@, @-0.2@]
max = [@0.1@, @0.55@, @0.2@]
radius = @0.02@
count = @5@
particles = @0@
[[cloth]]
corner = [@-0.15@, @0.05@, @-0.15@]
u = [@0.3@, @0.0@, @0.0@]
v = [@0.0@, @0.0@, @0.3@]
cells = [@8@, @8@]
velocity = [@0.0@, @0.0@, @0.0@]
areal_density = @0.2@
adjacent_stiffness = @400.0@
diagonal_stiffness = @200.0@
damping = @0.5@
spring_damping = @0.1@
retardation_time = @0.0@
thickness = @0.001@
)";
/// What the incompressible fluid alone can have.
constexpr const char* more_numbers = R"([[obstacle]]
type = "box"
position = [@0.0@, @-0.1@, @0.0@]
rotation_deg = [@0.0@, @20.0@, @0.0@]
size = [@0.1@, @0.1@, @0.1@]
friction = @0.3@
[[sink]]
type = "sphere"
position = [@0.2@, @-0.2@, @0.2@]
radius = @0.05@
start = @0.0@
[wind]
velocity = [@1.0@, @0.0@, @0.0@]
air_density = @1.2@
gust = @0.0@
gust_size = @1.0@
cloth_drag = @1.2@
fluid_drag = @1.0@
)";
constexpr const char* bad_numbers[] = {
    "nan",  "inf",   "-inf", "1e30",   "-1e30", "1e-310", "0",      "-0.0",
    "-1",   "-1e-9", "1e9",  "99999",  "1e-5",  "1000.0", "-99999", "9223372036854775807",
    "1e-9", "0.5",   "2",    "-1000.0"};

/// Two halves to a number: text, number, text, ...; one to three numbers are replaced.
std::string shot_with_bad_numbers(Chance& chance) {
  const bool incompressible = chance.below(4) > 0;
  std::string text = numbers + std::string(incompressible ? more_numbers : "");
  text.replace(text.find("SOLVER"), 6, incompressible ? "incompressible" : "weakly_compressible");
  std::vector<std::string> part{""};
  for (const char c : text) {
    if (c == '@')
      part.emplace_back();
    else
      part.back() += c;
  }
  for (int k = 1 + chance.below(3); k > 0; --k)
    part[size_t(1 + 2 * chance.below(int(part.size() / 2)))] = chance.one_of(bad_numbers);
  std::string shot;
  for (const std::string& p : part) shot += p;
  return shot;
}

/// Runs two frames, a second at most. @return "ran", the Error's text, or what else came of it
/// after "FAIL: ".
std::string outcome_of(const std::string& text) {
  const auto start = std::chrono::steady_clock::now();
  const auto in_time = [&] {
    return std::chrono::steady_clock::now() - start < std::chrono::seconds(1);
  };
  try {
    Simulator simulator(parse_shot(text, "fuzz.toml"), {.device = Device::cpu});
    simulator.preroll(in_time);
    for (int k = 0; k < 2; ++k) simulator.advance_frame(in_time);
    for (const V3f& p : simulator.particles().position)
      if (!(p.length() < 1e6f)) return "FAIL: a particle is out of this world";
    for (const ClothFrame& sheet : simulator.cloth()) {
      for (const V3f& p : sheet.mesh.position)
        if (!(p.length() < 1e6f)) return "FAIL: a vertex is out of this world";
    }
  } catch (const Error& error) {
    const std::string said = error.what();
    return said.size() > 20 ? said : "FAIL: it says " + said;
  } catch (const Stopped&) {
  } catch (const std::exception& other) {
    return std::string("FAIL: ") + other.what();
  }
  return "ran";
}

// Whatever numbers stand in a shot, it runs or is refused with a message.
TEST(Fuzz, NumbersOfAShotRunOrAreRefused) {
  int ran = 0, failed = 0, late = 0;
  const Seeds seeds(100, 5000);
  for (const int seed : seeds) {
    Chance chance(seed);
    const std::string text = shot_with_bad_numbers(chance);
    const double start = cpu_seconds();
    const std::string said = outcome_of(text);
    if (seeds.only()) std::cout << text << said << "\n";
    ran += said == "ran";
    if (said.starts_with("FAIL")) {
      ++failed;
      report("fuzz", fmt::format("numbers of a shot, seed {}", seed), false, said);
    }
    if (cpu_seconds() - start > 10) {
      ++late;
      report("fuzz", fmt::format("numbers of a shot, seed {}", seed), false, "takes over 10 CPU s");
    }
    if (seeds.row_after(seed)) {
      report("fuzz", "1 to 3 numbers of a shot, " + seeds.text(seed), failed == 0 && late == 0,
             fmt::format("{} ran, {} refused, {} neither", ran, seeds.count(seed) - ran - failed,
                         failed));
    }
  }
}

// --- Numbers of a state -------------------------------------------------------------------------

/// NaN with any payload, infinity, beyond 1e20 or a denormal, of either sign.
float bad_float(Chance& chance) {
  const uint32_t sign = uint32_t(chance.below(2)) << 31, any = uint32_t(chance() * 0x7fffff);
  switch (chance.below(4)) {
    case 0:
      return std::bit_cast<float>(sign | 0x7f800001u | any);
    case 1:
      return std::bit_cast<float>(sign | 0x7f800000u);
    case 2:
      return std::bit_cast<float>(sign | uint32_t(195 + chance.below(60)) << 23 | any);
    default:
      return std::bit_cast<float>(sign | any);
  }
}

struct Poisoned {
  std::string what;
  int particle = -1, vertex = -1;
};

/// One number of one column of a state.
Poisoned poison(sim::HostState& state, Chance& chance) {
  const int i = chance.below(int(state.id.size()));
  const int v = chance.below(int(state.cloth_position.size()));
  const float value = bad_float(chance);
  const auto put = [&](sim::HostVec& column, int at) {
    std::vector<float>* axis[] = {&column.x, &column.y, &column.z};
    (*axis[chance.below(3)])[size_t(at)] = value;
  };
  switch (chance.below(6)) {
    case 0:
      return put(state.position, i), Poisoned{fmt::format("place, {}", value), i};
    case 1:
      return put(state.velocity, i), Poisoned{fmt::format("velocity, {}", value), i};
    case 2:
      return put(state.cloth_position, v), Poisoned{fmt::format("vertex, {}", value), -1, v};
    case 3:
      return put(state.cloth_velocity, v),
             Poisoned{fmt::format("velocity of a vertex, {}", value), -1, v};
    case 4:
      state.pressure_term[size_t(i)] = value;
      return Poisoned{fmt::format("pressure, {}", value), i};
    default:
      return put(state.owed, v), Poisoned{fmt::format("impulse owed, {}", value), -1, v};
  }
}

/// Particles and vertices but the poisoned ones that are not finite, or faster than what falls.
int infected(const sim::HostState& state, int particle, int vertex) {
  int count = 0;
  for (size_t i = 0; i < state.id.size(); ++i) {
    count += state.id[i] != particle &&
             !(at(state.velocity, i).length() < 10 && at(state.position, i).length() < 1e6);
  }
  for (size_t v = 0; v < state.cloth_velocity.size(); ++v)
    count += int(v) != vertex && !(at(state.cloth_velocity, v).length() < 10);
  return count;
}

// One number of a state becomes a bad one, as a fault of memory would have it: a step names what is
// bad, or nothing else is infected after 100.
TEST(Fuzz, OneNumberOfAStateDoesNotSpread) {
  int named = 0, late = 0, silent = 0;
  const Seeds seeds(40, 3000);
  Stepper run(fall_on_sheet(100, 8));
  for (int k = 0; k < 60; ++k) run.step();  // it has met the sheet
  const sim::HostState clean = run.solver->save();
  for (const int seed : seeds) {
    Chance chance(seed);
    sim::HostState state = clean;
    const Poisoned poisoned = poison(state, chance);
    const int particle = poisoned.particle < 0 ? -1 : state.id[size_t(poisoned.particle)];
    run.solver->load(state), run.limits = {};
    std::string said;
    try {
      bool bad = false;
      int steps = 0;
      for (; steps < 100 && !bad; ++steps) {
        run.step(1e-3);
        bad = run.limits.bad_particle >= 0 || run.limits.bad_vertex >= 0;
      }
      const int others = infected(run.solver->save(), particle, poisoned.vertex);
      named += bad && steps <= 2, late += bad && steps > 2;
      if (!bad && others > 0) ++silent, said = fmt::format("{} others infected", others);
    } catch (const std::exception& error) {
      ++silent, said = error.what();
    }
    if (seeds.only() || !said.empty())
      report("fuzz", fmt::format("{}, seed {}", poisoned.what, seed), said.empty(), said);
    if (seeds.row_after(seed)) {
      report("fuzz", "one number of a state, " + seeds.text(seed), silent == 0,
             fmt::format("{} named within two steps, {} later, {} without harm, {} spread silently",
                         named, late, seeds.count(seed) - named - late - silent, silent));
    }
  }
}

// --- Scenes -------------------------------------------------------------------------------------

void add_random_sheet(Shot& shot, Chance& chance) {
  Cloth& sheet = shot.cloth.emplace_back();
  cotton(sheet);
  sheet.name = "sheet" + std::to_string(shot.cloth.size());
  // Any way it may lie, between two right angles.
  const double turn = chance.between(0, M_PI), lean = chance.between(-1, 1),
               size = chance.between(0.1, 0.3);
  const V3d u = V3d(std::cos(turn), 0, std::sin(turn)) * size;
  const V3d v =
      V3d(-std::sin(turn) * std::cos(lean), std::sin(lean), std::cos(turn) * std::cos(lean)) *
      chance.between(0.1, 0.3);
  sheet.u = u, sheet.v = v;
  sheet.corner =
      V3d(chance.between(-0.1, 0.1), chance.between(-0.05, 0.1), chance.between(-0.1, 0.1)) -
      (u + v) / 2;
  sheet.cells = V2i(1 + chance.below(20), 1 + chance.below(20));
  sheet.areal_density = chance.log_between(0.02, 20);
  sheet.adjacent_stiffness = chance.log_between(10, 1e5);
  sheet.diagonal_stiffness = sheet.adjacent_stiffness / 2;
  sheet.velocity = V3d(0, chance.between(-2, 2), 0);
  const int row = sheet.cells.x + 1, all = row * (sheet.cells.y + 1);
  ClothPin pin;
  const int pins = chance.below(4);  // none, a corner, an edge, anywhere
  for (int k = 0; k < all; ++k) {
    if ((pins == 1 && k == 0) || (pins == 2 && k < row) || (pins == 3 && chance.below(8) == 0))
      pin.vertices.push_back(uint32_t(k));
  }
  if (!pin.vertices.empty()) sheet.pin.push_back(pin);
}

void add_random_obstacle(Shot& shot, Chance& chance) {
  Obstacle& o = shot.obstacle.emplace_back();
  o.name = "obstacle" + std::to_string(shot.obstacle.size());
  o.type = chance.below(2) ? ObstacleType::sphere : ObstacleType::box;
  o.position =
      V3d(chance.between(-0.2, 0.2), chance.between(-0.35, -0.1), chance.between(-0.2, 0.2));
  o.radius = chance.between(0.04, 0.12), o.friction = chance.between(0, 1);
  o.size = V3d(chance.between(0.06, 0.2), chance.between(0.06, 0.2), chance.between(0.06, 0.2));
  if (o.type == ObstacleType::box)
    o.rotation_deg = V3d(chance.between(0, 90), chance.between(0, 90), chance.between(0, 90));
}

/// One or two bodies of fluid over up to two sheets and up to two obstacles, in a box of 0.6 m.
Shot random_scene(Chance& chance) {
  const double a = chance.between(0.015, 0.03);
  Shot shot = water(a);
  shot.domain.min = V3d(-0.3, -0.4, -0.3), shot.domain.max = V3d(0.3, 1.2, 0.3);
  for (int k = 0; k < 3; ++k)
    shot.domain.axis[size_t(k)] = k != 1 && chance.below(3) == 0 ? Axis::periodic : Axis::walls;
  shot.fluid.kinematic_viscosity = chance.below(3) ? 1e-6 : chance.log_between(1e-6, 1);
  shot.fluid.surface_tension = chance.below(4) ? 0 : 0.072;
  for (int k = 1 + chance.below(2); k > 0; --k) {
    const V3d velocity(chance.between(-3, 3), chance.between(-5, 1), chance.between(-3, 3));
    const std::array<int, 3> cells{2 + chance.below(7), 2 + chance.below(7), 2 + chance.below(7)};
    add_box(shot, V3d(chance.between(-0.25, 0.05), 0.15 + 0.3 * k, chance.between(-0.25, 0.05)),
            cells, velocity);
  }
  for (int k = chance.below(3); k > 0; --k) add_random_sheet(shot, chance);
  for (int k = chance.below(3); k > 0; --k) add_random_obstacle(shot, chance);
  return shot;
}

std::string text_of(const Shot& shot) {
  std::string text = fmt::format("a {:.3f} m", shot.fluid.spacing);
  for (const Cloth& c : shot.cloth) {
    text += fmt::format(", {} x {} cells, {:.2g} kg/m^2, {:.2g} N/m", c.cells.x, c.cells.y,
                        c.areal_density, c.adjacent_stiffness);
  }
  for (const Obstacle& o : shot.obstacle)
    text += o.type == ObstacleType::sphere ? ", sphere" : ", box";
  return text;
}

struct Fuzzed {
  int refused = 0, failed = 0, fast = 0, gaining = 0;
  double fastest = 0, gained = 0;
};

void run_random_scene(int seed, bool told, Fuzzed& all) {
  Chance chance(seed);
  const Shot shot = random_scene(chance);
  sim::Scene scene;
  try {
    scene = sim::build_scene(shot);
  } catch (const Error&) {  // fluid in cloth, a sheet in an obstacle, edges that nearly meet
    ++all.refused;
    return;
  }
  Watch watch(std::move(scene), 0);
  watch.until(long_form() ? 0.6 : 0.4);
  const Figures f = watch.figures();
  const bool holds = f.finite && f.whole && f.crossings == 0, fast = f.max_speed > f.speed_bound,
             gains = f.energy > 0.02;
  all.failed += !holds, all.fast += fast, all.gaining += gains;
  all.fastest = std::max(all.fastest, f.max_speed / f.speed_bound);
  all.gained = std::max(all.gained, f.energy);
  if (holds && !told) return;
  Gates gates = squeezed();
  gates.speed = gates.energy = not_gated;
  report("fuzz", fmt::format("scene of seed {}: {}", seed, text_of(shot)), watch, gates);
}

// Nothing blows up, is lost or crosses; the other rules are counted.
TEST(Fuzz, RandomScenesNeitherBlowUpNorLeak) {
  Fuzzed all;
  const Seeds seeds(20, 2000);
  for (const int seed : seeds) {
    run_random_scene(seed, seeds.only(), all);
    if (seeds.row_after(seed)) {
      report("fuzz", "random scenes, " + seeds.text(seed), all.failed == 0,
             fmt::format("{} refused, {} blow up or leak; over the speed {}, most {:.0f} %; over "
                         "the energy {}, most {:.1f} %",
                         all.refused, all.failed, all.fast, 100 * all.fastest, all.gaining,
                         100 * all.gained));
    }
  }
}

}  // namespace
}  // namespace drench::stress_tests
