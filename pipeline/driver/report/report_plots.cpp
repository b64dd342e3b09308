#include "pipeline/driver/report/report_plots.h"

#include <algorithm>
#include <cmath>

#include "pipeline/driver/rules.h"

namespace drench {

using nlohmann::json;

namespace {

/// A line of a plot: a member of the rows of a step.
struct Line {
  const char *name, *key;
  int component = -1;  // of a member that is a list
};

struct PlotRow {
  Step step;
  const char *title, *unit;
  std::vector<Line> lines;
  bool logarithmic = false;
};

const std::vector<PlotRow>& simulation_plots() {
  static const std::vector<PlotRow> rows{
      {Step::simulate, "Steps", "", {{"steps", "steps"}}},
      {Step::simulate,
       "Length of steps",
       "s",
       {{"largest", "largest_dt"}, {"smallest", "smallest_dt"}},
       true},
      {Step::simulate,
       "Iterations of a frame",
       "",
       {{"pressure", "iterations"},
        {"viscosity", "viscous_iterations"},
        {"sheets", "sheet_sweeps"}}},
      {Step::simulate,
       "Density error",
       "",
       {{"largest", "max_compression"}, {"mean", "mean_compression"}},
       true},
      {Step::simulate, "Largest speed", "m/s", {{"speed", "max_speed"}}},
      {Step::simulate, "Kinetic energy", "J", {{"energy", "kinetic_energy"}}},
      {Step::simulate,
       "Momentum",
       "kg m/s",
       {{"x", "momentum", 0}, {"y", "momentum", 1}, {"z", "momentum", 2}}},
      {Step::simulate, "Particles", "", {{"particles", "particles"}}},
      {Step::simulate,
       "Particles that came and went",
       "",
       {{"emitted", "emitted"}, {"lost through open sides", "lost"}}},
      {Step::simulate, "Water in cloth", "kg", {{"water", "water_in_cloth"}}},
      {Step::simulate,
       "Contacts of cloth that bear",
       "",
       {{"sheets", "sheet_contacts"}, {"obstacles", "obstacle_contacts"}}},
      {Step::simulate, "Particles held back at sheets", "", {{"held", "guard_hits"}}},
      {Step::simulate,
       "Steps that did not converge",
       "",
       {{"pressure", "unconverged"},
        {"viscosity", "viscous_unconverged"},
        {"sheets", "sheets_cut_short"}}},
  };
  return rows;
}

const std::vector<PlotRow>& surface_plots() {
  static const std::vector<PlotRow> rows{
      {Step::mesh, "Triangles of the surface", "", {{"triangles", "triangles"}}},
      {Step::mesh, "Volume", "l", {{"surface", "surface_l"}, {"particles", "particles_l"}}},
      {Step::foam, "Foam", "", {{"spray", "spray"}, {"foam", "foam"}, {"bubbles", "bubbles"}}},
  };
  return rows;
}

const std::vector<PlotRow>& picture_plots() {
  static const std::vector<PlotRow> rows{
      {Step::render,
       "Relative squared error",
       "",
       {{"samples", "relative_mse"}, {"photons", "photon_error"}},
       true},
      {Step::render, "Camera samples", "", {{"samples", "camera_samples"}}},
      {Step::render, "Light that walks found", "", {{"share", "walked"}}},
  };
  return rows;
}

double value_of(const json& row, const Line& line) {
  const auto found = row.find(line.key);
  if (found == row.end()) return std::nan("");
  const json& value =
      line.component >= 0 && found->is_array() && size_t(line.component) < found->size()
          ? (*found)[size_t(line.component)]
          : *found;
  return value.is_number() ? value.get<double>() : std::nan("");
}

Plot plot_of(const ReportData& data, const PlotRow& row) {
  Plot plot{.title = row.title, .x_name = "frame", .unit = row.unit, .series = {}};
  plot.logarithmic = row.logarithmic;
  const auto rows = data.rows.find(row.step);
  if (rows == data.rows.end()) return plot;
  for (const Line& line : row.lines) {
    PlotSeries series{line.name, {}, {}};
    bool any = false;  // a line of zeros says nothing that its absence does not
    for (const auto& [frame, values] : rows->second) {
      series.x.push_back(frame);
      series.y.push_back(value_of(values, line));
      any = any || (std::isfinite(series.y.back()) && series.y.back() != 0);
    }
    if (any) plot.series.push_back(std::move(series));
  }
  return plot;
}

void add_section(std::vector<PlotSection>& sections, const char* title, std::vector<Plot> plots) {
  std::erase_if(plots, [](const Plot& plot) { return plot.series.empty(); });
  if (!plots.empty()) sections.push_back({title, std::move(plots)});
}

std::vector<Plot> plots_of(const ReportData& data, const std::vector<PlotRow>& rows) {
  std::vector<Plot> plots;
  for (const PlotRow& row : rows) plots.push_back(plot_of(data, row));
  return plots;
}

/// "height [m]" -> "height", "m"
std::pair<std::string, std::string> name_and_unit(const std::string& column) {
  const size_t mark = column.find(" [");
  if (mark == std::string::npos || column.back() != ']') return {column, ""};
  return {column.substr(0, mark), column.substr(mark + 2, column.size() - mark - 3)};
}

/// A plot for all columns of one unit.
std::vector<Plot> probe_plots(const ProbeTable& probe) {
  std::vector<Plot> plots;
  for (size_t k = 1; k < probe.columns.size(); ++k) {
    const auto [name, unit] = name_and_unit(probe.columns[k]);
    auto plot = std::find_if(plots.begin(), plots.end(),
                             [&, unit = unit](const Plot& p) { return p.unit == unit; });
    if (plot == plots.end()) {
      plots.push_back({.title = probe.name, .x_name = "time [s]", .unit = unit, .series = {}});
      plot = plots.end() - 1;
    }
    plot->series.push_back({name, probe.values[0], probe.values[k]});
  }
  for (Plot& plot : plots)
    if (plot.series.size() == 1) plot.title += ": " + plot.series.front().name;
  return plots;
}

/// A member of the rows of every stage that makes frames.
Plot stages_of(const ReportData& data, Plot plot, const char* key) {
  for (const auto& [step, rows] : data.rows) {
    if (!is_per_frame(step)) continue;
    PlotSeries series{std::string(step_name(step)), {}, {}};
    for (const auto& [frame, row] : rows) {
      series.x.push_back(frame);
      series.y.push_back(value_of(row, {"", key}));
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

}  // namespace

std::vector<PlotSection> report_plots(const ReportData& data) {
  std::vector<PlotSection> sections;
  const Plot time{.title = "Time of a frame",
                  .x_name = "frame",
                  .unit = "s",
                  .series = {},
                  .kind = Plot::Kind::stacked_bars};
  const Plot memory{
      .title = "Most memory of the process so far", .x_name = "frame", .unit = "MiB", .series = {}};
  add_section(sections, "Time and memory",
              {stages_of(data, time, "wall_s"), stages_of(data, memory, "peak_mib")});
  add_section(sections, "Simulation", plots_of(data, simulation_plots()));
  add_section(sections, "Surface", plots_of(data, surface_plots()));
  add_section(sections, "Picture", plots_of(data, picture_plots()));
  std::vector<Plot> probes;
  for (const ProbeTable& probe : data.probes)
    for (Plot& plot : probe_plots(probe)) probes.push_back(std::move(plot));
  add_section(sections, "Probes", std::move(probes));
  return sections;
}

}  // namespace drench
