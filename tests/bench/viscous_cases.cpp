// Case fluid_viscosity: starts of Couette and Poiseuille flow against their series, a spreading
// block against Huppert's exponent (tests/validation/viscous.h), and what the implicit solve costs:
// iterations and share of the time in a block that slumps, by dt nu / h^2.

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/bench/bench.h"
#include "tests/sim/support.h"
#include "tests/validation/body_drag.h"
#include "tests/validation/viscous.h"

namespace drench::bench {
namespace {

void channels(const Emit& emit) {
  for (const validation::Flow flow : {validation::Flow::couette, validation::Flow::poiseuille}) {
    for (const double shaken : {0., 0.25}) {
      for (const int across : sizes({10, 20, 40}, 1)) {
        validation::Channel result;
        Line line;
        line.cost = measure([&] { result = validation::start_up(flow, across, shaken); });
        line.method = flow == validation::Flow::couette ? "Couette" : "Poiseuille";
        line.method += shaken > 0 ? ", shaken" : ", lattice";
        line.resolution = std::to_string(across) + " across";
        line.threads = hardware_threads();
        line.error = std::max({result.error[0], result.error[1], result.error[2]}),
        line.gate = 0.02;
        line.error_of = "L2 of u over u_max, worst of nu t / L^2 = 0.05, 0.2, 1";
        for (const double error : result.error) line.more["errors"].push_back(error);
        line.more["strength"] = result.strength;
        line.more["iterations"] = result.iterations;
        line.more["energy_across"] = result.thickness;
        emit(line);
      }
    }
  }
}

void spreading(const Emit& emit) {
  for (const int high : sizes({8, 12, 16}, 1)) {
    validation::Spreading result;
    Line line;
    line.cost = measure([&] { result = validation::huppert(high); });
    line.method = "Huppert";
    line.resolution = std::to_string(high) + " layers, " + std::to_string(result.particles);
    line.threads = hardware_threads();
    line.error = result.front, line.gate = 0.06;
    line.error_of = "RMS of the front's relative error";
    line.more["exponent"] = result.exponent;
    line.more["energy_gain"] = result.energy_gain;
    line.more["energy_across"] = result.thickness;
    line.more["steps"] = result.steps;
    emit(line);
  }
}

void body_drag(const Emit& emit) {
  for (const int across : sizes({6, 12, 24}, 2)) {
    validation::Dragged trough;
    Line line;
    line.cost = measure([&] { trough = validation::lid_driven(across); });
    line.method = "trough under a sliding plane", line.threads = hardware_threads();
    line.resolution = std::to_string(across) + " across, " + std::to_string(trough.particles);
    line.error = trough.error, line.gate = 0.07;
    line.error_of = "L2 of u over U";
    line.more["return_flow"] = trough.scale;
    line.more["energy_across"] = trough.thickness;
    emit(line);
  }
  constexpr const char* name[] = {"plane", "box", "sheet"};
  for (const auto floor :
       {validation::Floor::plane, validation::Floor::box, validation::Floor::sheet}) {
    for (const int layers : sizes({6, 12, 24}, 2)) {
      validation::Dragged film;
      Line line;
      line.cost = measure([&] { film = validation::film(floor, layers); });
      line.method = std::string("film on a ") + name[int(floor)];
      line.threads = hardware_threads();
      line.resolution = std::to_string(layers) + " layers, " + std::to_string(film.particles);
      line.error = std::abs(film.scale - 1);
      if (layers == 24) line.gate = 0.03;
      line.error_of = "mean speed over Nusselt's, less 1";
      line.more["l2"] = film.error;
      line.more["force"] = film.force;
      line.more["energy_across"] = film.thickness;
      emit(line);
    }
  }
}
const Registration drag{"fluid_body_drag", "fluid that does not slip along obstacles and sheets",
                        body_drag, InQuick::yes};

/// A block of 24 x 24 x 24 slumps on a no-slip floor for 40 steps of 2 ms.
void cost(const Emit& emit) {
  for (const double strength : sizes({0., 0.0099, 0.1, 1., 10., 100.}, 4)) {
    constexpr double dt = 2e-3, a = 0.01;
    constexpr int steps = 40;
    Shot shot = sim_tests::empty_shot();
    shot.fluid.solver = FluidSolver::incompressible;
    shot.gravity = V3d(0, -9.81, 0), shot.domain.min.y = 0;
    shot.domain.axis[1] = Axis::walls, shot.domain.slip = Slip::none;
    shot.fluid.kinematic_viscosity = strength * std::pow(2.15 * a, 2) / dt;
    sim_tests::add_box(shot, V3d(-0.12, 0, -0.12), {24, 24, 24});
    sim_tests::Stepper run(shot);
    double iterations = 0, pressure = 0;
    Line line;
    line.cost = measure([&] {
      for (int k = 0; k < steps; ++k) {
        run.step(dt);
        iterations += double(run.limits.viscous_iterations) / steps;
        pressure += double(run.limits.iterations) / steps;
      }
    });
    line.method = "cost";
    line.resolution = std::to_string(run.solver->particles()) + " particles, 40 steps";
    line.time_step = dt, line.threads = hardware_threads();
    line.more["strength"] = strength;
    line.more["iterations"] = iterations;
    line.more["pressure_iterations"] = pressure;
    emit(line);
  }
}

const Registration viscosity{"fluid_viscosity", "viscous flows against closed forms, and the cost",
                             [](const Emit& emit) { channels(emit), spreading(emit), cost(emit); },
                             InQuick::yes};

}  // namespace
}  // namespace drench::bench
