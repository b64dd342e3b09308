#include "pipeline/contract/shot/shot_rows.h"

namespace drench::shot_table {

namespace {

Row grid_pins_row() {
  Row row;
  row.section = "cloth";
  row.key = "pins";
  row.kind = Kind::grid_pins;
  row.stages = simulate;
  row.description =
      "held vertices of a grid: one or an array of these names; u0 is the edge where u starts. "
      "Turned into [[cloth.pin]] vertices. A sheet that spans a periodic axis has no rim there, "
      "but "
      "rim and corners hold that line, too: name the two other edges";
  row.choices.assign(enum_names<GridPins>.begin(), enum_names<GridPins>.end());
  return row;
}

}  // namespace

std::vector<Parameter> cloth_rows() {
  return {
      row<&Cloth::name>(
          "cloth", "name", "", none, simulate | render,
          "name of the sheet, part of its file names; cloth, cloth2, ... unless given")
          .identity(),
      row<&Cloth::corner>("cloth", "corner", "m", coordinate, simulate,
                          "grid: where u and v start"),
      row<&Cloth::u>("cloth", "u", "m", coordinate, simulate, "grid: one edge"),
      row<&Cloth::v>("cloth", "v", "m", coordinate, simulate, "grid: the other edge"),
      row<&Cloth::cells>(
          "cloth", "cells", "", {1, 4096}, simulate,
          "grid: [along u, along v]; vertex j (cells_u + 1) + i stands at i along u"),
      row<&Cloth::mesh_file>("cloth", "mesh", "", none, simulate,
                             "PLY or OBJ file of triangles instead of a grid"),
      row<&Cloth::weld>("cloth", "weld", "m", {-1, 1}, simulate,
                        "mesh: vertices on free edges within this distance of one another are "
                        "sewn, as exporters split them at seams of the texture; 0 keeps them "
                        "apart, -1 is 1e-5 of the mesh's diagonal"),
      grid_pins_row(),
      row<&Cloth::velocity>("cloth", "velocity", "m/s", speed, simulate, "at the start"),
      row<&Cloth::areal_density>("cloth", "areal_density", "kg/m^2", {1e-4, 1e4}, simulate,
                                 "mass of an area; of a shell that gives none its fabric's"),
      row<&Cloth::adjacent_stiffness>("cloth", "adjacent_stiffness", "N/m", {0, 1e9}, simulate,
                                      "two-dimensional modulus of the springs along edges")
          .only(ClothModel::automatic, ClothModel::springs),
      row<&Cloth::diagonal_stiffness>(
          "cloth", "diagonal_stiffness", "N/m", {0, 1e9}, simulate,
          "of the springs along both diagonals; half of adjacent_stiffness is isotropic")
          .only(ClothModel::automatic, ClothModel::springs),
      row<&Cloth::damping>("cloth", "damping", "1/s", {0, 1e4}, simulate,
                           "rate at which velocity is lost"),
      row<&Cloth::spring_damping>("cloth", "spring_damping", "", {0, 1}, simulate,
                                  "along each spring, fraction of critical; keeps momentum")
          .only(ClothModel::automatic, ClothModel::springs),
      row<&Cloth::retardation_time>("cloth", "retardation_time", "s", {0, 1}, simulate,
                                    "inner friction, viscosity over stiffness of every spring: a "
                                    "swing of period T loses 1 - exp(-2 pi^2 t / T) of its height "
                                    "with this t; cotton about 0.005. Beside incompressible fluid "
                                    "only")
          .only(ClothModel::automatic, ClothModel::springs),
      row<&Cloth::thickness>("cloth", "thickness", "m", {1e-6, 1}, simulate,
                             "thickness; of a shell that gives none its fabric's"),
      row<&Cloth::model>(
          "cloth", "model", "", none, simulate,
          "shell: a continuous sheet with the constants of a fabric. springs: a net "
          "of springs without bending, as published. automatic: springs where any of "
          "their constants is given, or beside weakly compressible fluid, else a "
          "shell")
          .identity(),
      row<&Cloth::fabric>("cloth", "fabric", "", none, simulate,
                          "a name that `drench fabrics` lists: the constants that are not given")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::young_warp>("cloth", "young_warp", "N/m", {1e-3, 1e8}, simulate,
                              "Young's modulus times thickness along warp: along u of a grid, "
                              "along the first texture coordinate of a mesh")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::young_weft>("cloth", "young_weft", "N/m", {1e-3, 1e8}, simulate, "along weft")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::shear_modulus>("cloth", "shear_modulus", "N/m", {1e-3, 1e8}, simulate,
                                 "shear modulus times thickness")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::poisson>("cloth", "poisson", "", {-0.99, 0.99}, simulate,
                           "geometric mean of the two Poisson ratios, in its plane and in bending")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::bend_warp>("cloth", "bend_warp", "N m", {0, 1e4}, simulate,
                             "rigidity: moment per width over curvature, bent along warp")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::bend_weft>("cloth", "bend_weft", "N m", {0, 1e4}, simulate, "bent along weft")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::bend_bias>("cloth", "bend_bias", "N m", {0, 1e4}, simulate,
                             "bent along the diagonal between them")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::stretch_limit>("cloth", "stretch_limit", "", {1.0001, 100}, simulate,
                                 "length over rest length beyond which it stiffens, softly")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::damping_time>(
          "cloth", "damping_time", "s", {0, 10}, simulate,
          "inner friction, viscosity over stiffness of stretching and bending")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::friction>("cloth", "friction", "", {0, 10}, simulate,
                            "Coulomb's coefficient of the sheet on itself; of two sheets on each "
                            "other the geometric mean counts")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::self_collision>("cloth", "self_collision", "", none, simulate,
                                  "whether it meets itself and other shells: nothing crosses")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::soaks>("cloth", "soaks", "", none, simulate,
                         "whether it takes up fluid that touches it, and gets heavier")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::wetness>("cloth", "wetness", "", {0, 1}, simulate,
                           "at the start: share of its pores that is full of water")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::water_capacity>("cloth", "water_capacity", "kg/m^2", {0, 1e4}, simulate,
                                  "mass of the water on an area that is full")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::soak_time>("cloth", "soak_time", "s", {0, 1e6}, simulate,
                             "in which fluid that touches it fills 63 % of what is left to fill")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::dry_time>(
          "cloth", "dry_time", "s", {0, 1e9}, simulate,
          "in which it loses 63 % of its water where no fluid is; 0: it stays wet")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::wet_modulus_ratio>(
          "cloth", "wet_modulus_ratio", "", {1e-2, 100}, simulate,
          "moduli and rigidities when full over those when dry; the mean "
          "wetness of the sheet counts")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::wet_friction>("cloth", "wet_friction", "", {0, 10}, simulate,
                                "as friction, when full")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::sleep_speed>(
          "cloth", "sleep_speed", "m/s", {-1, 10}, simulate,
          "a shell that has moved slower than this in the mean for two seconds, and gets no "
          "faster, "
          "sleeps: it stays where it is and costs nothing until fluid, an obstacle, a pin or a "
          "sheet that moves comes near. 0: it never sleeps; -1: 1 mm/s, or a 500th of its diagonal "
          "a second if that is less")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::write_strain>(
          "cloth", "write_strain", "", none, simulate,
          "whether its files hold strain_max and strain_min, length over rest length less 1 along "
          "the two principal directions, and stress_max and stress_min, N/m, the elastic stress "
          "times the thickness: means of the triangles at a vertex, by area")
          .only(ClothModel::automatic, ClothModel::shell),
      row<&Cloth::slip>("cloth", "slip", "", none, simulate,
                        "how the incompressible solver's fluid meets it: free, or none (it moves "
                        "with the sheet, which it drags along). automatic is as that of "
                        "domain.slip"),
      row<&Cloth::contact_angle_deg>("cloth", "contact_angle_deg", "deg", {30, 150}, simulate,
                                     contact_angle_text),
      row<&Cloth::material>("cloth", "material", "", none, render, "name of a [[material]]"),
      row<&Cloth::matte>("cloth", "matte", "", none, render, matte_text),
      row<&Cloth::subdivision>(
          "cloth", "subdivision", "", {-1, 4}, mesh | render,
          "levels of Loop's subdivision in pictures and where fluid is meshed against it, each of "
          "which divides triangles into 4; nothing moves by half its thickness. 0: as simulated, "
          "as its files are. -1: 2, or as many as leave it no more than 262,144 triangles"),

      row<&ClothPin::vertices>("cloth.pin", "vertices", "", {0, 4294967294.0}, simulate,
                               "indices of vertices that are held"),
      row<&ClothPin::box>(
          "cloth.pin", "box", "m", coordinate, simulate,
          "{min = [x, y, z], max = [x, y, z]}: every vertex inside it at the start"),
      row<&ClothPin::position>("cloth.pin", "position", "m", coordinate, simulate,
                               "keys that move the group off where it starts: what they change by "
                               "since the start of the simulation counts"),
      row<&ClothPin::rotation_deg>("cloth.pin", "rotation_deg", "deg", turns, simulate,
                                   "keys that turn it, about x, then y, then z through pivot"),
      row<&ClothPin::position>("cloth.pin", "interp", "", none, simulate,
                               "between the keys of position and rotation_deg")
          .interpolation({Interpolation::linear, Interpolation::smooth}),
      row<&ClothPin::pivot>("cloth.pin", "pivot", "m", coordinate, simulate,
                            "what the group turns about, as it stands at the start; without it the "
                            "middle of the group's box"),
      row<&ClothPin::on>("cloth.pin", "on", "", none, simulate,
                         "an obstacle by name that carries the group along, as it moves, turns and "
                         "deforms; in place of keys")
          .as(Kind::label),
      row<&ClothPin::release>("cloth.pin", "release", "s", {0, ClothPin::never}, simulate,
                              "after the simulation's start the group is let go"),
      row<&ClothPin::stiffness>("cloth.pin", "stiffness", "N/m", {0, 1e9}, simulate,
                                "of a spring that pulls each vertex to its place; 0 holds it "
                                "there"),

      row<&ClothSeam::edge>("cloth.seam", "edge", "", none, simulate,
                            "edge of this grid that is sewn; u0 is the one where u starts"),
      row<&ClothSeam::vertices>("cloth.seam", "vertices", "", {0, 4294967294.0}, simulate,
                                "or indices of its vertices"),
      row<&ClothSeam::to>("cloth.seam", "to", "", none, simulate,
                          "name of the other sheet; without it the seam joins the sheet to itself"),
      row<&ClothSeam::to_edge>("cloth.seam", "to_edge", "", none, simulate,
                               "edge of the other grid, of as many vertices, whichever end is "
                               "nearer first"),
      row<&ClothSeam::to_vertices>("cloth.seam", "to_vertices", "", {0, 4294967294.0}, simulate,
                                   "or indices of its vertices, each for the one in the same place "
                                   "of the other list"),
      row<&ClothSeam::stiffness>("cloth.seam", "stiffness", "N/m", {0, 1e9}, simulate,
                                 "of the spring between a pair of vertices; 0 is ten times the "
                                 "modulus of the stiffer sheet"),
      row<&ClothSeam::rest_length>("cloth.seam", "rest_length", "m", {-1, 1e4}, simulate,
                                   "of these springs; -1 is what contact keeps the sheets apart, "
                                   "half of both thicknesses"),
      row<&ClothSeam::time>("cloth.seam", "time", "s", {0, 1e6}, simulate,
                            "in which they are drawn from their length at the start to that; 0 "
                            "draws at once"),

      row<&Coupling::scheme>("coupling", "scheme", "", none, simulate,
                             "exact, or paper: Harada, Koshizuka, Kawaguchi 2007 as published"),
  };
}

}  // namespace drench::shot_table
