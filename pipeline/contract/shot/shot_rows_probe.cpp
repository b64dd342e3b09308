#include "pipeline/contract/shot/shot_rows.h"

namespace drench::shot_table {

std::vector<Parameter> probe_rows() {
  return {
      row<&Probe::type>("probe", "type", "", none, simulate, "what is measured on every step")
          .needed()
          .identity(),
      row<&Probe::name>("probe", "name", "", none, simulate,
                        "part of its file's name, sim/probe.NAME.csv; probe, probe2, ... unless "
                        "given")
          .identity(),
      row<&Probe::position>("probe", "position", "m", coordinate, simulate,
                            "height: the vertical line through it; pressure: centre of the disc; "
                            "velocity: centre of the ball; tip: the vertex nearest to it at rest")
          .only(ProbeType::height, ProbeType::pressure, ProbeType::tip, ProbeType::velocity),
      row<&Probe::normal>("probe", "normal", "", coordinate, simulate,
                          "of the disc; any length but 0. A disc within half a spacing of a wall "
                          "of the domain, an obstacle or a sheet, and along it, measures what is "
                          "pushed there; of a sheet the side that it points to")
          .only(ProbeType::pressure),
      row<&Probe::radius>("probe", "radius", "m", {1e-6, 1e4}, simulate,
                          "of the disc or ball; below a spacing it counts as one")
          .only(ProbeType::pressure, ProbeType::velocity),
      row<&Probe::direction>("probe", "direction", "", coordinate, simulate,
                             "along which the farthest fluid is looked for; any length but 0")
          .only(ProbeType::front),
      row<&Probe::on>("probe", "on", "", none, simulate,
                      "an obstacle by name: position and normal are its own coordinates, in m from "
                      "its position along its turned axes, and move with it; a plane's y axis is "
                      "its normal")
          .as(Kind::label)
          .only(ProbeType::height, ProbeType::pressure, ProbeType::velocity),
      row<&Probe::interval>("probe", "interval", "s", {0, 1e6}, simulate,
                            "between rows, at ends of steps; 0: a row for every step"),
      row<&Probe::window>("probe", "window", "s", {0, 1}, simulate,
                          "the mean columns are means over so much time before each row")
          .only(ProbeType::pressure, ProbeType::force),
      row<&Probe::target>("probe", "target", "", none, simulate,
                          "what the fluid pushes: a domain wall, x_low to z_high, an obstacle or "
                          "a sheet, by name")
          .only(ProbeType::force),
      row<&Probe::cloth>("probe", "cloth", "", none, simulate, "name of the sheet")
          .only(ProbeType::tip),
      row<&Probe::vertex>("probe", "vertex", "", {-1, 2e9}, simulate,
                          "of the sheet; -1: the one nearest to position at rest")
          .only(ProbeType::tip),
  };
}

}  // namespace drench::shot_table
