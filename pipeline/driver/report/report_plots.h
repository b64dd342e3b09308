#pragma once
// What stats.jsonl and the probes say, frame by frame, as plots.

#include <string>
#include <vector>

#include "pipeline/driver/report/report_data.h"
#include "pipeline/driver/report/svg_plot.h"

namespace drench {

/// Plots of a section of the page: "Simulation", "Surface", "Picture", "Probes".
struct PlotSection {
  std::string title;
  std::vector<Plot> plots;  // those that have values
};

std::vector<PlotSection> report_plots(const ReportData& data);

}  // namespace drench
