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
                                 "mass of an area; cotton has about 0.2"),
      row<&Cloth::adjacent_stiffness>("cloth", "adjacent_stiffness", "N/m", {0, 1e9}, simulate,
                                      "two-dimensional modulus of the springs along edges"),
      row<&Cloth::diagonal_stiffness>(
          "cloth", "diagonal_stiffness", "N/m", {0, 1e9}, simulate,
          "of the springs along both diagonals; half of adjacent_stiffness is isotropic"),
      row<&Cloth::damping>("cloth", "damping", "1/s", {0, 1e4}, simulate,
                           "rate at which velocity is lost"),
      row<&Cloth::spring_damping>("cloth", "spring_damping", "", {0, 1}, simulate,
                                  "along each spring, fraction of critical; keeps momentum"),
      row<&Cloth::retardation_time>("cloth", "retardation_time", "s", {0, 1}, simulate,
                                    "inner friction, viscosity over stiffness of every spring: a "
                                    "swing of period T loses 1 - exp(-2 pi^2 t / T) of its height "
                                    "with this t; cotton about 0.005. Beside incompressible fluid "
                                    "only"),
      row<&Cloth::thickness>("cloth", "thickness", "m", {1e-6, 1}, simulate, "thickness"),
      row<&Cloth::slip>("cloth", "slip", "", none, simulate,
                        "how the incompressible solver's fluid meets it: free, or none (it moves "
                        "with the sheet, which it drags along). automatic is as that of "
                        "domain.slip"),
      row<&Cloth::contact_angle_deg>("cloth", "contact_angle_deg", "deg", {30, 150}, simulate,
                                     contact_angle_text),
      row<&Cloth::material>("cloth", "material", "", none, render, "name of a [[material]]"),
      row<&Cloth::matte>("cloth", "matte", "", none, render, matte_text),

      row<&ClothPin::vertices>("cloth.pin", "vertices", "", {0, 4294967294.0}, simulate,
                               "indices of vertices held where they start"),
      row<&ClothPin::box>(
          "cloth.pin", "box", "m", coordinate, simulate,
          "{min = [x, y, z], max = [x, y, z]}: every vertex inside it at the start"),

      row<&Coupling::scheme>("coupling", "scheme", "", none, simulate,
                             "exact, or paper: Harada, Koshizuka, Kawaguchi 2007 as published"),
  };
}

}  // namespace drench::shot_table
