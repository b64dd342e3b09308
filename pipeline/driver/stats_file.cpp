#include "pipeline/driver/stats_file.h"

#include <nlohmann/json.hpp>

#include "pipeline/driver/json_lines.h"
#include "pipeline/driver/process.h"
#include "pipeline/driver/standard_output.h"

namespace drench {

void StatsFile::add(std::string_view step, int frame, double wall_s, const std::string& json) {
  nlohmann::json object = nlohmann::json::parse(json);
  object["frame"] = frame;
  object["wall_s"] = wall_s;
  object["peak_mib"] = int64_t(peak_memory() >> 20);
  add(step, object.dump());
}

void StatsFile::add(std::string_view step, const std::string& json) {
  nlohmann::json object = nlohmann::json::parse(json);
  object["step"] = step;
  const std::scoped_lock lock(mutex_);
  append_lines(file_, json_line(object));
}

}  // namespace drench
