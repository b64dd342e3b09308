#include "pipeline/contract/shot/shot_rows.h"

namespace drench::shot_table {

std::vector<Parameter> fluid_rows() {
  return {
      row<&Fluid::spacing>("fluid", "spacing", "m", {1e-5, 10}, simulate | mesh,
                           "distance a of particles at rest; a particle has mass rest_density a^3"),
      row<&Fluid::support_ratio>("fluid", "support_ratio", "", {0, 6}, simulate,
                                 "support radius of the kernels / spacing; 0 is 2.15 for the "
                                 "incompressible solver and 2 for the weakly compressible one"),
      row<&Fluid::solver>("fluid", "solver", "", none, simulate,
                          "incompressible solves for the pressure that keeps the density, in large "
                          "steps; weakly_compressible follows sound, in small ones. automatic is "
                          "incompressible but for coupling.scheme \"paper\""),
      row<&Fluid::tolerance>("fluid", "tolerance", "", {1e-7, 0.1}, simulate,
                             "of the incompressible solver: mean error of the density over rest "
                             "density that a step may leave. The one knob of quality against time"),
      row<&Fluid::xsph>("fluid", "xsph", "", {0, 1}, simulate,
                        "of the incompressible solver: share of its neighbours' mean velocity that "
                        "a particle takes on every step"),
      row<&Fluid::rest_density>("fluid", "rest_density", "kg/m^3", {1, 1e5}, simulate, "at rest"),
      row<&Fluid::kinematic_viscosity>("fluid", "kinematic_viscosity", "m^2/s", {0, 1000}, simulate,
                                       "of the fluid; water has 1e-6"),
      row<&Fluid::surface_tension>(
          "fluid", "surface_tension", "N/m", {0, 100}, simulate,
          "of the incompressible solver: surface tension against air; water has 0.072. Surfaces "
          "meet walls, obstacles and sheets at their contact_angle_deg"),
      row<&Fluid::artificial_viscosity>(
          "fluid", "artificial_viscosity", "", {0, 10}, simulate,
          "of the weakly compressible solver: alpha of Monaghan 1992; 0 is none"),
      row<&Fluid::sound_speed>(
          "fluid", "sound_speed", "m/s", {0, 1e4}, simulate,
          "of the weakly compressible solver: stiffness; 0 chooses ten times the "
          "largest speed expected"),
      row<&Fluid::write_source>(
          "fluid", "write_source", "", none, simulate,
          "particles and the mesh's vertices get the number of their source: boxes, spheres, "
          "drops, volumes, then emitters, each in the order of the shot, from 0"),
      row<&Fluid::write_age>("fluid", "write_age", "", none, simulate,
                             "particles and the mesh's vertices get their time in the shot, s"),
      row<&Fluid::material>("fluid", "material", "", none, render, "name of a [[material]]"),

      row<&FluidBox::min>("fluid.box", "min", "m", coordinate, simulate, "lower corner").needed(),
      row<&FluidBox::max>("fluid.box", "max", "m", coordinate, simulate, "upper corner").needed(),
      row<&FluidBox::velocity>("fluid.box", "velocity", "m/s", speed, simulate, "at the start"),

      row<&FluidSphere::center>("fluid.sphere", "center", "m", coordinate, simulate, "centre")
          .needed(),
      row<&FluidSphere::radius>("fluid.sphere", "radius", "m", {0, 1e4}, simulate, "radius")
          .needed(),
      row<&FluidSphere::velocity>("fluid.sphere", "velocity", "m/s", speed, simulate,
                                  "at the start"),

      row<&FluidDrops::min>("fluid.drops", "min", "m", coordinate, simulate,
                            "lower corner of the centres")
          .needed(),
      row<&FluidDrops::max>("fluid.drops", "max", "m", coordinate, simulate,
                            "upper corner of the centres")
          .needed(),
      row<&FluidDrops::velocity>("fluid.drops", "velocity", "m/s", speed, simulate, "at the start"),
      row<&FluidDrops::radius>("fluid.drops", "radius", "m", {0, 1e4}, simulate, "of a drop")
          .needed(),
      row<&FluidDrops::count>("fluid.drops", "count", "", {0, 1e6}, simulate, "number of drops")
          .needed(),
      row<&FluidDrops::particles>(
          "fluid.drops", "particles", "", {0, 2e8}, simulate,
          "exactly so many particles in all; 0: as many as the radius holds"),
  };
}

}  // namespace drench::shot_table
