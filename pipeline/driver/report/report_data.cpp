#include "pipeline/driver/report/report_data.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <sstream>

#include "pipeline/contract/error.h"
#include "pipeline/driver/json_lines.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/rules.h"

namespace drench {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

std::string text_at(const json& line, const char* key) {
  const auto found = line.find(key);
  return found != line.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// Rows by step and frame, runs, and warnings: a run writes its own at its end, together.
void read_rows(const fs::path& file, ReportData& data) {
  bool in_warnings = false;
  for (json& line : read_json_lines(file)) {
    const std::string name = text_at(line, "step");
    if (name == "warning") {
      if (!in_warnings) data.warnings.clear();
      in_warnings = true;
      data.warnings.push_back(std::move(line));
      continue;
    }
    in_warnings = false;
    const auto frame = line.find("frame");
    if (name == "run") {
      data.runs.push_back(std::move(line));
    } else if (const std::optional<Step> step = step_named(name);
               step && frame != line.end() && frame->is_number_integer()) {
      const int at = frame->get<int>();
      data.rows[*step][at] = std::move(line);
    }
  }
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells{""};
  for (const char c : line) {
    if (c == ',') {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  return cells;
}

}  // namespace

ProbeTable parse_probe(const std::string& name, const std::string& text) {
  ProbeTable table{.name = name, .comments = {}, .columns = {}, .values = {}};
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#')) {
      table.comments.push_back(line.substr(std::min<size_t>(2, line.size())));
      continue;
    }
    const std::vector<std::string> cells = cells_of(line);
    if (table.columns.empty()) {
      table.columns = cells;
      table.values.resize(cells.size());
    } else if (cells.size() == table.columns.size()) {
      for (size_t k = 0; k < cells.size(); ++k)
        table.values[k].push_back(cells[k].empty() ? std::nan("") : std::atof(cells[k].c_str()));
    }
  }
  return table;
}

bool ReportData::is_rendered(int frame) const {
  const std::string file = layout::image(job.targets.shot, frame);
  return files.contains(file) && fs::exists(job.folder / file);
}

std::vector<int> ReportData::rendered() const {
  std::vector<int> frames;
  for (const int frame : job.targets.frames)
    if (is_rendered(frame)) frames.push_back(frame);
  return frames;
}

ReportData read_report_data(const fs::path& folder) {
  ReportData data;
  data.job = job_in(folder);
  const Manifest manifest(folder / layout::manifest);
  data.plan = plan_of(data.job, manifest);
  data.files = manifest.records();
  read_rows(folder / layout::stats, data);
  for (const std::string& name : data.job.targets.probe) {
    const std::string file = layout::probe(name);
    if (data.files.contains(file) && fs::exists(folder / file))
      data.probes.push_back(parse_probe(name, read_text(folder / file, uint64_t(1) << 30)));
  }
  const std::string movie = layout::movie(data.job.targets.shot);
  if (data.files.contains(movie) && fs::exists(folder / movie)) data.movie = folder / movie;
  return data;
}

}  // namespace drench
