#pragma once
// Shots from their text, run by the Simulator, and the files of their probes read back.

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "pipeline/contract/shot/shot_file.h"
#include "sim/simulator.h"

namespace drench::sim_tests {

/// Columns of a probe's file by their headers; an empty cell is NaN.
using Columns = std::map<std::string, std::vector<double>>;

inline Columns columns_of(const std::string& csv) {
  std::istringstream lines(csv);
  std::vector<std::string> names;
  Columns columns;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '#') continue;
    if (line.back() == ',') line += "nan";
    std::istringstream cells(line);
    std::vector<std::string> row;
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
    if (names.empty()) {
      names = row;
      continue;
    }
    for (size_t k = 0; k < names.size(); ++k)
      columns[names.at(k)].push_back(row.at(k).empty() ? std::nan("") : std::stod(row.at(k)));
  }
  return columns;
}

struct Probed {
  Shot shot;
  Simulator simulator;

  explicit Probed(const std::string& text)
      : shot(parse_shot(text, "probed.toml")), simulator(shot, {.device = Device::cpu}) {}
  Probed& run_to(int frame) {
    while (simulator.frame() < frame) simulator.advance_frame();
    return *this;
  }
  std::string csv(const std::string& name) const {
    for (const ProbeText& probe : simulator.probes()) {
      if (probe.name == name) return probe.csv;
    }
    throw std::out_of_range("no probe " + name);
  }
  Columns columns(const std::string& name) const { return columns_of(csv(name)); }
  /// Mean of a column over the rows after `since`, s, by time.
  double mean(const std::string& name, const std::string& column, double since) const {
    const Columns all = columns(name);
    const std::vector<double>&time = all.at("time [s]"), &value = all.at(column);
    double sum = 0, length = 0;
    for (size_t k = 1; k < time.size(); ++k) {
      if (time[k - 1] < since) continue;
      sum += value[k] * (time[k] - time[k - 1]), length += time[k] - time[k - 1];
    }
    return sum / length;
  }
};

}  // namespace drench::sim_tests
