// Probes of walls and obstacles that touch the same fluid, against hydrostatics and momentum.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sim/probed.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

constexpr double g = 9.81, rho = 1000, depth = 0.2;

std::string tank_text(double a, double width, double breadth, double height) {
  return fmt::format(R"(
[shot]
frames = [1, 31]
fps = 20
[domain]
min = [0, 0, 0]
max = [{}, {}, {}]
[fluid]
spacing = {}
tolerance = 1e-5
)",
                     width, height, breadth, a);
}
std::string water_text(double x0, double y0, double x1, double y1, double breadth) {
  return fmt::format("[[fluid.box]]\nmin = [{}, {}, 0]\nmax = [{}, {}, {}]\n", x0, y0, x1, y1,
                     breadth);
}
std::string box_text(const std::string& name, double x0, double x1, double breadth, double height) {
  return fmt::format(R"([[obstacle]]
type = "box"
name = "{}"
position = [{}, {}, {}]
size = [{}, {}, {}]
)",
                     name, (x0 + x1) / 2, height / 2, breadth / 2, x1 - x0, height + depth,
                     2 * breadth);
}
std::string force_text(const std::string& target) {
  return fmt::format("[[probe]]\ntype = \"force\"\nname = \"{0}\"\ntarget = \"{0}\"\n", target);
}
std::string disc_text(const std::string& name, double x, double y, double z,
                      const std::string& normal, double radius) {
  return fmt::format(
      "[[probe]]\ntype = \"pressure\"\nname = \"{}\"\nposition = [{}, {}, {}]\nnormal = {}\n"
      "radius = {}\n",
      name, x, y, z, normal, radius);
}

class Layers : public testing::TestWithParam<int> {
 protected:
  /// Of the hydrostatic value; at 10 layers the surface, half a layer thick, shows.
  double tolerance() const { return GetParam() < 20 ? 0.05 : 0.03; }
};

// Water between a wall and a box, dry beyond. The wall behind the box bears nothing, the wetted one
// rho g H^2 B / 2, the box the same on its side; a disc on the box, and half a spacing to two and a
// half before it, reads rho g times its depth as on and before a wall and a floor.
TEST_P(Layers, OfWaterPushTheBodiesThatTheyTouchAndNoOther) {
  const double a = depth / GetParam(), breadth = 8 * a, height = 1.5 * depth;
  std::string text = tank_text(a, 18 * a, breadth, height) +
                     water_text(0, 0, 8 * a, depth, breadth) +
                     box_text("block", 8 * a, 14 * a, breadth, height);
  for (const char* body : {"x_low", "x_high", "y_low", "z_low", "block"}) text += force_text(body);
  const double away[] = {0, 0.5, 0.75, 1, 1.5, 2.5};
  for (const double off : away) {
    const int name = int(100 * off);
    text +=
        disc_text(fmt::format("box{}", name), (8 - off) * a, depth / 2, breadth / 2, "[1, 0, 0]",
                  3 * a) +
        disc_text(fmt::format("wall{}", name), off * a, depth / 2, breadth / 2, "[1, 0, 0]",
                  3 * a) +
        disc_text(fmt::format("floor{}", name), 4 * a, off * a, breadth / 2, "[0, 1, 0]", 3 * a);
  }
  Probed run(text);
  run.run_to(31);
  const double side = rho * g * depth * depth * breadth / 2,
               weight = rho * g * depth * breadth * 8 * a;
  const auto force = [&](const char* probe, char axis) {
    return run.mean(probe, fmt::format("force {} [N]", axis), 0.75);
  };
  EXPECT_NEAR(force("x_low", 'x') / side, -1, tolerance());
  EXPECT_NEAR(force("block", 'x') / side, 1, tolerance());
  EXPECT_NEAR(force("x_high", 'x') / side, 0, 1e-6);
  EXPECT_NEAR((force("y_low", 'y') + force("block", 'y')) / weight, -1, 0.01);
  EXPECT_NEAR(force("z_low", 'z') / side, -1, tolerance());
  for (const double off : away) {
    const auto over = [&](const char* what, double below) {
      return run.mean(fmt::format("{}{}", what, int(100 * off)), "pressure [Pa]", 0.75) /
             (rho * g * below);
    };
    EXPECT_NEAR(over("box", depth / 2), 1, tolerance()) << off;
    EXPECT_NEAR(over("wall", depth / 2), 1, tolerance()) << off;
    // A disc in which the depth counts only below half a spacing is on the floor itself.
    EXPECT_NEAR(over("floor", off > 0.5 ? depth - off * a : depth), 1, tolerance()) << off;
  }
}

std::string held_sheet_text(const std::string& name, const std::string& corner,
                            const std::string& u, const std::string& v) {
  return fmt::format(R"([[cloth]]
name = "{}"
model = "springs"
corner = {}
u = {}
v = {}
cells = [16, 16]
[[cloth.pin]]
box = {{min = [-1, -1, -1], max = [1, 1, 1]}}
)",
                     name, corner, u, v);
}

// A sheet that is held everywhere is a floor and a wall: water stands on a lying one and before a
// standing one, both dry behind. Discs on the wet sides and before them read rho g times the depth,
// on the dry ones nothing. Together the sheets bear the weight and the thrust: in their corner a
// particle is pushed by the nearer one alone, along its normal there.
class LayersOnSheets : public Layers {};

TEST_P(LayersOnSheets, PushTheWetSides) {
  const double a = depth / GetParam(), breadth = 8 * a, under = 4 * a, wet = 12 * a,
               height = 1.5 * depth, middle = under + depth / 2;
  std::string text =
      tank_text(a, wet + 4 * a, breadth, height) +
      water_text(0, under, wet, under + depth, breadth) +
      held_sheet_text("lying", fmt::format("[0, {}, 0]", under), fmt::format("[{}, 0, 0]", wet),
                      fmt::format("[0, 0, {}]", breadth)) +
      held_sheet_text("standing", fmt::format("[{}, {}, 0]", wet, under),
                      fmt::format("[0, {}, 0]", height - under),
                      fmt::format("[0, 0, {}]", breadth)) +
      force_text("lying") + force_text("standing");
  const double away[] = {0, 0.5, 1, 1.5};
  for (const double off : away) {
    const int name = int(100 * off);
    text += disc_text(fmt::format("lying{}", name), wet / 2, under + off * a, breadth / 2,
                      "[0, 1, 0]", 2 * a) +
            disc_text(fmt::format("standing{}", name), wet - off * a, middle, breadth / 2,
                      "[-1, 0, 0]", 2 * a);
  }
  text += disc_text("behind", wet, middle, breadth / 2, "[1, 0, 0]", 2 * a) +
          disc_text("below", wet / 2, under, breadth / 2, "[0, -1, 0]", 2 * a);
  Probed run(text);
  run.run_to(31);
  const double weight = rho * g * depth * breadth * wet,
               thrust = rho * g * depth * depth * breadth / 2;
  const auto force = [&](const std::string& axis) {
    const std::string column = "force " + axis + " [N]";
    return run.mean("lying", column, 0.75) + run.mean("standing", column, 0.75);
  };
  EXPECT_NEAR(force("y") / weight, -1, 0.01);
  EXPECT_NEAR(force("x") / thrust, 1, tolerance());
  const auto pressure = [&](const std::string& name) {
    return run.mean(name, "pressure [Pa]", 0.75);
  };
  EXPECT_EQ(pressure("behind"), 0);
  EXPECT_EQ(pressure("below"), 0);
  std::string figures;
  for (const double off : away) {
    const int name = int(100 * off);
    const double on = off > 0.5 ? off * a : 0;  // nearer than half a spacing it is on the sheet
    const double lying = pressure(fmt::format("lying{}", name)) / (rho * g * (depth - on)),
                 standing = pressure(fmt::format("standing{}", name)) / (rho * g * depth / 2);
    figures += fmt::format("{}: {:.3f} {:.3f}  ", off, lying, standing);
    EXPECT_NEAR(lying, 1, tolerance()) << off;
    EXPECT_NEAR(standing, 1, tolerance()) << off;
  }
  RecordProperty("figures", figures);
}

INSTANTIATE_TEST_SUITE_P(Probes, Layers, testing::Values(10, 20, 40),
                         [](const auto& p) { return fmt::format("{}Layers", p.param); });

INSTANTIATE_TEST_SUITE_P(Probes, LayersOnSheets, testing::Values(10, 20),
                         [](const auto& p) { return fmt::format("{}Layers", p.param); });

// The side, the top and the bottom of a ball, 5 spacings in radius: rho g times their depths below
// the level, within 4.5 % of what its middle has. The level is that of the volume of water and
// ball, as the weight above any depth is. The solver bears 3 % more on it than the weight that it
// displaces; the rest is how few particles stand around it.
TEST(DiscOnABall, ReadsThePressureOfItsDepth) {
  const double a = depth / 20, side = 16 * a, radius = 5 * a;
  std::string text = tank_text(a, side, side, 1.5 * depth) + water_text(0, 0, side, depth, side);
  text += fmt::format(
      "[[obstacle]]\ntype = \"sphere\"\nname = \"ball\"\nposition = [{0}, {1}, {0}]\n"
      "radius = {2}\n[[probe]]\ntype = \"volume\"\nname = \"water\"\n",
      side / 2, depth / 2, radius);
  const double away[] = {0, 0.5, 1, 1.5};
  for (const double off : away) {
    const int name = int(100 * off);
    const double out = radius + off * a;
    text += disc_text(fmt::format("side{}", name), side / 2 + out, depth / 2, side / 2, "[1, 0, 0]",
                      2 * a) +
            disc_text(fmt::format("top{}", name), side / 2, depth / 2 + out, side / 2, "[0, 1, 0]",
                      2 * a) +
            disc_text(fmt::format("bottom{}", name), side / 2, depth / 2 - out, side / 2,
                      "[0, 1, 0]", 2 * a);
  }
  Probed run(text);
  run.run_to(31);
  const double volume =
      run.mean("water", "volume [m^3]", 0.75) + 4. / 3 * M_PI * radius * radius * radius;
  const double level = volume / (side * side), whole = rho * g * depth / 2;
  for (const double off : away) {
    const double on = off > 0.5 ? off * a : 0;  // nearer than half a spacing it is on the ball
    const auto error = [&](const char* what, double height) {
      return run.mean(fmt::format("{}{}", what, int(100 * off)), "pressure [Pa]", 0.75) / whole -
             rho * g * (level - height) / whole;
    };
    RecordProperty(fmt::format("off{}", int(100 * off)),
                   fmt::format("side {:.3f} top {:.3f} bottom {:.3f}", error("side", depth / 2),
                               error("top", depth / 2 + radius + on),
                               error("bottom", depth / 2 - radius - on)));
    EXPECT_NEAR(error("side", depth / 2), 0, 0.045) << off;
    EXPECT_NEAR(error("top", depth / 2 + radius + on), 0, 0.045) << off;
    EXPECT_NEAR(error("bottom", depth / 2 - radius - on), 0, 0.045) << off;
  }
}

// A block that stands on the floor: what water presses on its top and the floor around it is the
// weight above each, and a disc on the floor, half of it under the block, reads the depth.
TEST(BlockOnTheFloor, LeavesTheCornerToNeither) {
  const double a = depth / 20, side = 16 * a, size = 8 * a, high = 10 * a;
  const std::string text = tank_text(a, side, side, 1.5 * depth) +
                           water_text(0, 0, side, depth, side) +
                           fmt::format(R"([[obstacle]]
type = "box"
name = "block"
position = [{0}, {1}, {0}]
size = [{2}, {3}, {2}]
rotation_deg = [0, 90, 0]
[[probe]]
type = "volume"
name = "water"
)",
                                       side / 2, high / 2, size, high) +
                           force_text("block") + force_text("y_low") +
                           disc_text("half", side / 2 + size / 2, 0, side / 2, "[0, 1, 0]", 2 * a);
  Probed run(text);
  run.run_to(31);
  const double water = run.mean("water", "volume [m^3]", 0.75),
               level = (water + size * size * high) / (side * side);
  const double top = rho * g * (level - high) * size * size,
               floor = rho * g * level * (side * side - size * size);
  const double on_block = run.mean("block", "force y [N]", 0.75),
               on_floor = run.mean("y_low", "force y [N]", 0.75);
  const double disc = run.mean("half", "pressure [Pa]", 0.75) / (rho * g * level);
  RecordProperty("figures", fmt::format("block {:.4f} floor {:.4f} disc {:.4f}", -on_block / top,
                                        -on_floor / floor, disc));
  EXPECT_NEAR(-on_block / top, 1, 0.03);
  EXPECT_NEAR(-on_floor / floor, 1, 0.03);
  EXPECT_NEAR(disc, 1, 0.03);
}

/// Queries for the force on all six walls and all obstacles.
std::vector<sim::ProbeQuery> all_bodies(int obstacles) {
  std::vector<sim::ProbeQuery> all;
  for (int k = 0; k < 6; ++k) {
    all.emplace_back().kind = sim::ProbeKind::wall_force;
    all.back().axis = k / 2, all.back().side = k % 2;
  }
  for (int k = 0; k < obstacles; ++k) {
    all.emplace_back().kind = sim::ProbeKind::obstacle_force;
    all.back().begin = k;
  }
  return all;
}

// A dam breaks over a box beside a ball: what the momentum of the fluid lacks of gravity's impulse
// is the sum over all bodies, however many touch one particle. What is stopped at walls by the last
// tenth of a spacing (collision_rounds.h) is not in it.
class BookKeeping : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Sheet, BookKeeping, testing::Bool());
TEST_P(BookKeeping, CountsEachForceOnceOnOneBody) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -g, 0);
  shot.domain.min = V3d(0), shot.domain.max = V3d(0.24, 0.3, 0.08);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  shot.fluid.solver = FluidSolver::incompressible;
  shot.domain.slip = Slip::free;
  add_box(shot, V3d(0, 0, 0), {10, 16, 8}, V3d(0.4, 0, 0));
  Obstacle box;
  box.type = ObstacleType::box, box.position = V3d(0.17, 0.03, 0.04),
  box.size = V3d(0.06, 0.06, 0.2);
  shot.obstacle.push_back(box);
  Obstacle ball;
  ball.type = ObstacleType::sphere, ball.position = V3d(0.13, 0.02, 0.04), ball.radius = 0.018;
  ball.name = "ball";
  shot.obstacle.push_back(ball);
  if (GetParam()) {  // across the front, above both, held at its sides
    Cloth sheet;
    sheet.corner = V3d(0.11, 0.075, 0.004), sheet.u = V3d(0, 0.07, 0), sheet.v = V3d(0, 0, 0.072);
    sheet.cells = V2i(14, 14), sheet.areal_density = 0.3;
    ClothPin pin;
    for (uint32_t i = 0; i < 15; ++i) pin.vertices.insert(pin.vertices.end(), {i, 14 * 15 + i});
    sheet.pin.push_back(pin);
    shot.cloth.push_back(sheet);
  }
  Stepper run(shot);
  const double mass = run.scene.parameters.particle_mass * run.solver->particles();
  std::vector<sim::ProbeQuery> bodies = all_bodies(2);
  if (GetParam()) {
    bodies.emplace_back().kind = sim::ProbeKind::cloth_force;
    bodies.back().end = run.scene.cloth.vertices();
  }
  const auto momentum = [&] {
    const sim::HostState state = run.solver->save();
    V3d sum(0);
    for (size_t i = 0; i < state.id.size(); ++i) {
      sum += at(state.velocity, i) * double(run.scene.parameters.particle_mass);
      if (GetParam()) sum -= at(state.owed, i);  // the sheet's, from the next step on
    }
    return sum;
  };
  V3d before = momentum(), missing(0), impulse(0);
  std::vector<double> each(bodies.size(), 0);
  while (run.time < 0.3) {
    const double time = run.time;
    run.step();
    const double dt = run.time - time;
    V3d force(0);
    const auto forces = run.solver->probe(bodies);
    for (size_t k = 0; k < forces.size(); ++k) {
      const V3d f(forces[k][0], forces[k][1], forces[k][2]);
      force += f, each[k] += f.length() * dt;
    }
    const V3d after = momentum();
    missing += before + V3d(0, -g, 0) * (mass * dt) - after - force * dt;
    impulse += force * dt, before = after;
  }
  RecordProperty("figures", fmt::format("{:.2e}", missing.length() / impulse.length()));
  EXPECT_LT(missing.length(), 0.02 * impulse.length());
  for (const size_t k : {size_t(0), size_t(2), size_t(6), size_t(7), bodies.size() - 1})
    EXPECT_GT(each[k], 0.01 * impulse.length()) << k;
}

// A dam breaks against a box as broad as the tank: discs side by side over its face, weighted by
// the areas that they stand for, have the peak and the impulse of the force on the box.
TEST(PatchPressure, OfADamBreakSumsToTheForceOnTheBox) {
  const double a = 0.01, breadth = 0.12, face = 0.3, height = 0.36;
  std::string text = tank_text(a, 0.4, breadth, height);
  text.replace(text.find("frames = [1, 31]"), 16, "frames = [1, 13]");
  text += water_text(0, 0, 0.12, depth, breadth) + box_text("block", face, 0.4, breadth, 0.4) +
          force_text("block");
  // Squares of 3 cm, each with a disc of the same area; the soft rims overlap their neighbours.
  const double edge = 0.03, radius = edge / std::sqrt(M_PI);
  int count = 0;
  for (double y = edge / 2; y < height; y += edge)
    for (double z = edge / 2; z < breadth; z += edge)
      text += disc_text(fmt::format("disc{}", count++), face, y, z, "[1, 0, 0]", radius);
  Probed run(text);
  run.run_to(13);
  const Columns block = run.columns("block");
  const std::vector<double>&time = block.at("time [s]"), &force = block.at("force x [N]");
  std::vector<double> patch(time.size(), 0);
  for (int k = 0; k < count; ++k) {
    const Columns disc = run.columns(fmt::format("disc{}", k));
    for (size_t t = 1; t < time.size(); ++t) patch[t] += disc.at("pressure [Pa]")[t] * edge * edge;
  }
  double sum = 0, sum_patch = 0, peak = 0, peak_patch = 0;
  for (size_t t = 1; t < time.size(); ++t) {
    const double dt = time[t] - time[t - 1];
    sum += force[t] * dt, sum_patch += patch[t] * dt;
    peak = std::max(peak, force[t]), peak_patch = std::max(peak_patch, patch[t]);
  }
  RecordProperty("figures",
                 fmt::format("impulse {:.3f} peak {:.3f}", sum_patch / sum, peak_patch / peak));
  EXPECT_NEAR(sum_patch / sum, 1, 0.03);
  EXPECT_NEAR(peak_patch / peak, 1, 0.05);
}

}  // namespace
}  // namespace drench::sim_tests
