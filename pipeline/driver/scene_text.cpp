#include "pipeline/driver/scene_text.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace drench {

using nlohmann::json;

std::string scene_text(const sim::SceneReport& report) {
  std::string text = fmt::format(
      "starts with {} particles, {} triangles of cloth and {} of obstacles; at the end about "
      "{:.0f} "
      "particles, {:.0f} MiB, some {:.0f} steps a frame\n",
      report.particles, report.cloth_triangles, report.obstacle_triangles, report.particles_at_end,
      report.memory / double(1 << 20), report.steps_a_frame);
  for (const sim::SourceReport& source : report.source) {
    const size_t lost = source.overlapping + source.outside + source.in_obstacles();
    text += fmt::format("  {}  {} particles", source.name, source.kept);
    if (lost > 0) {
      text += fmt::format(" of {}: {} in obstacles, {} outside, {} in other sources", source.asked,
                          source.in_obstacles(), source.outside, source.overlapping);
    }
    text += "\n";
  }
  for (const sim::InletReport& inlet : report.inlet) {
    text += fmt::format("  {}  about {:.0f} particles", inlet.name, inlet.emitted);
    if (inlet.blocked > 0) text += fmt::format(", {:.0f} % blocked", 100 * inlet.blocked);
    text += "\n";
  }
  return text;
}

json scene_json(const sim::SceneReport& report) {
  json sources = json::array(), inlets = json::array();
  for (const sim::SourceReport& source : report.source) {
    sources.push_back({{"name", source.name},
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
  return {{"particles", report.particles},
          {"particles_at_end", report.particles_at_end},
          {"cloth_triangles", report.cloth_triangles},
          {"obstacle_triangles", report.obstacle_triangles},
          {"memory_bytes", report.memory},
          {"steps_a_frame", report.steps_a_frame},
          {"source", sources},
          {"inlet", inlets}};
}

}  // namespace drench
