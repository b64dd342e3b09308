#include "pipeline/driver/scene_text.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace drench {

using nlohmann::json;

namespace {

double litres(double particles, double spacing) {
  return 1000 * particles * spacing * spacing * spacing;
}
/// Of what the shot asks for; of the lattice where that is not known.
double asked_litres(const sim::SourceReport& source, double spacing) {
  return source.volume > 0 ? 1000 * source.volume : litres(double(source.asked), spacing);
}

/// "  fluid.box[0]  2940 particles, 2.94 of 3 litres: rounding -1.5 %, obstacles -0.5 %".
std::string source_text(const sim::SourceReport& source, double spacing) {
  const double asked = asked_litres(source, spacing);
  std::string text = fmt::format("  {}  {} particles, {:.4g} of {:.4g} litres", source.name,
                                 source.kept, litres(double(source.kept), spacing), asked);
  const char* before = ": ";
  const auto part = [&](const char* what, double share) {
    if (std::abs(share) < 5e-4) return;
    text += fmt::format("{}{} {:+.1f} %", before, what, 100 * share);
    before = ", ";
  };
  const auto taken = [&](size_t particles) { return -litres(double(particles), spacing) / asked; };
  part("rounding", source.rounding(spacing));
  part("obstacles", taken(source.in_obstacles()));
  part("beyond open sides", taken(source.outside));
  part("other sources", taken(source.overlapping));
  return text + "\n";
}

}  // namespace

std::string scene_text(const sim::SceneReport& report) {
  std::string text = fmt::format(
      "starts with {} particles, {} triangles of cloth and {} of obstacles; at the end about "
      "{:.0f} "
      "particles, {:.0f} MiB, some {:.0f} steps a frame\n",
      report.particles, report.cloth_triangles, report.obstacle_triangles, report.particles_at_end,
      report.memory / double(1 << 20), report.steps_a_frame);
  if (report.preroll > 0)
    text += fmt::format("  before the first frame a pre-roll of {:g} s, some {:.0f} steps\n",
                        report.preroll, report.preroll_steps);
  for (const sim::SourceReport& source : report.source) text += source_text(source, report.spacing);
  for (const sim::SheetReport& sheet : report.sheet) {
    text += fmt::format("  cloth.{}  {} triangles, {}\n", sheet.name, sheet.triangles,
                        sheet.fabric.empty() ? "springs" : "shell of " + sheet.fabric);
  }
  for (const sim::InletReport& inlet : report.inlet) {
    text += fmt::format("  {}  about {:.0f} particles", inlet.name, inlet.emitted);
    if (inlet.blocked > 0) text += fmt::format(", {:.0f} % blocked", 100 * inlet.blocked);
    text += "\n";
  }
  return text;
}

json scene_json(const sim::SceneReport& report) {
  json sources = json::array(), inlets = json::array(), sheets = json::array();
  for (const sim::SourceReport& source : report.source) {
    sources.push_back({{"name", source.name},
                       {"asked_litres", asked_litres(source, report.spacing)},
                       {"litres", litres(double(source.kept), report.spacing)},
                       {"asked", source.asked},
                       {"kept", source.kept},
                       {"in_obstacles", source.in_obstacles()},
                       {"outside", source.outside},
                       {"overlapping", source.overlapping}});
  }
  for (const sim::InletReport& inlet : report.inlet) {
    inlets.push_back(
        {{"name", inlet.name}, {"emitted", inlet.emitted}, {"blocked", inlet.blocked}});
  }
  for (const sim::SheetReport& sheet : report.sheet) {
    sheets.push_back({{"name", sheet.name},
                      {"model", sheet.fabric.empty() ? "springs" : "shell"},
                      {"fabric", sheet.fabric},
                      {"triangles", sheet.triangles}});
  }
  return {{"particles", report.particles},
          {"particles_at_end", report.particles_at_end},
          {"cloth_triangles", report.cloth_triangles},
          {"obstacle_triangles", report.obstacle_triangles},
          {"memory_bytes", report.memory},
          {"steps_a_frame", report.steps_a_frame},
          {"preroll_s", report.preroll},
          {"preroll_steps", report.preroll_steps},
          {"source", sources},
          {"cloth", sheets},
          {"inlet", inlets}};
}

}  // namespace drench
