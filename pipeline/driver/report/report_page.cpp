#include "pipeline/driver/report/report_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "build_id.h"
#include "pipeline/driver/frame_range.h"
#include "pipeline/driver/progress.h"
#include "pipeline/driver/report/page_assets.h"
#include "pipeline/driver/report/report_plots.h"
#include "pipeline/driver/rules.h"
#include "pipeline/driver/shell_word.h"

namespace drench {

using nlohmann::json;

namespace {

std::string section(std::string_view id, std::string_view title, const std::string& content) {
  if (content.empty()) return {};
  return fmt::format("<section id=\"{}\"><h2>{}</h2>\n{}</section>\n", id, html_text(title),
                     content);
}

/// Cells are HTML; a heading that begins with '#' is a column of numbers.
std::string table(const std::vector<std::string>& headings,
                  const std::vector<std::vector<std::string>>& rows) {
  if (rows.empty()) return {};
  const auto is_number = [&](size_t k) { return headings[k].starts_with('#'); };
  std::string text = "<table><tr>";
  for (size_t k = 0; k < headings.size(); ++k)
    text += fmt::format("<th{}>{}</th>", is_number(k) ? " class=\"n\"" : "",
                        html_text(std::string_view(headings[k]).substr(is_number(k) ? 1 : 0)));
  text += "</tr>\n";
  for (const std::vector<std::string>& row : rows) {
    text += "<tr>";
    for (size_t k = 0; k < row.size(); ++k)
      text += fmt::format("<td{}>{}</td>", is_number(k) ? " class=\"n\"" : "", row[k]);
    text += "</tr>\n";
  }
  return text + "</table>\n";
}

std::string member_text(const json& line, const char* key) {
  const auto found = line.find(key);
  if (found == line.end()) return {};
  return found->is_string() ? found->get<std::string>() : found->dump();
}

double number_at(const json& line, const char* key) {
  const auto found = line.find(key);
  return found != line.end() && found->is_number() ? found->get<double>() : 0;
}

std::string head(const ReportData& data, bool live) {
  const Shot& shot = data.job.shot;
  const std::vector<int>& frames = data.job.targets.frames;
  std::string text = fmt::format("<header><h1>{}</h1><div class=\"facts\">", html_text(shot.name));
  const auto fact = [&](std::string_view name, const std::string& value) {
    text += fmt::format("<span>{} <b>{}</b></span>", name, html_text(value));
  };
  fact("frames", format_frames(frames));
  fact("rendered", fmt::format("{} of {}", data.rendered().size(), frames.size()));
  fact("size", fmt::format("{} x {}", shot.render.width, shot.render.height));
  fact("rate", fmt::format("{:g} a second", shot.timeline.fps));
  fact("warnings", std::to_string(data.warnings.size()));
  if (!data.runs.empty()) fact("made by", member_text(data.runs.back(), "version"));
  if (live) text += "<span class=\"live\">live</span>";
  return text + "</div></header>\n";
}

std::string warnings(const ReportData& data) {
  std::string text;
  for (const json& warning : data.warnings) {
    const double times = number_at(warning, "times");
    text += fmt::format("<p>{}: {}{}</p>\n", html_text(member_text(warning, "part")),
                        html_text(member_text(warning, "text")),
                        times > 1 ? fmt::format(" ({:.0f} times)", times) : "");
  }
  return text.empty() ? text : "<div class=\"warnings\">" + text + "</div>\n";
}

std::string sheet(const ReportData& data, const PageImages& images) {
  std::string text = "<div class=\"sheet\">\n";
  auto image = images.images.begin();
  for (const int frame : data.job.targets.frames) {
    if (image != images.images.end() && image->frame == frame) {
      text += fmt::format(
          "<button aria-label=\"frame {0}\"><img src=\"{1}\" alt=\"frame "
          "{0}\"><span>{0}{2}</span></button>\n",
          frame, html_text(image->small), image->in_work ? ", in work" : "");
      ++image;
    } else {
      text += fmt::format("<div class=\"missing\">{}</div>\n", frame);
    }
  }
  text += "</div>\n";
  const std::string size = images.scale < 1
                               ? fmt::format("{:.0f} % of the frames' size", 100 * images.scale)
                               : "full size";
  text += fmt::format(
      "<p>A frame opens at {}. Arrows step, space plays, Z shows its own pixels{}.</p>\n", size,
      images.compared.empty() ? "" : ", B the other run");
  return text;
}

/// What is there of a stage, and what it took.
struct StageRow {
  int done = 0, frames = 0;
  double sum = 0, most = 0;  // s
  int measured = 0, slowest = 0;
};

std::map<Step, StageRow> stage_rows(const ReportData& data) {
  std::map<Step, StageRow> rows;
  for (const Task& task : data.plan.tasks) {
    StageRow& row = rows[task.step];
    ++row.frames;
    row.done += task.action == Action::skip;
  }
  for (const auto& [step, lines] : data.rows) {
    StageRow& row = rows[step];
    row.measured = int(lines.size());
    for (const auto& [frame, line] : lines) {
      const double seconds = number_at(line, "wall_s");
      row.sum += seconds;
      if (seconds < row.most) continue;
      row.most = seconds;
      row.slowest = frame;
    }
  }
  return rows;
}

std::string stages(const ReportData& data) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& [step, row] : stage_rows(data)) {
    const bool has_frames = is_per_frame(step) && row.measured > 0;
    const double mean = row.measured > 0 ? row.sum / row.measured : 0,
                 left = mean * (row.frames - row.done);
    rows.push_back({html_text(step_name(step)),
                    fmt::format("<progress value=\"{}\" max=\"{}\"></progress>", row.done,
                                std::max(1, row.frames)),
                    fmt::format("{} of {}", row.done, row.frames), left > 0 ? clock_text(left) : "",
                    row.measured > 0 ? fmt::format("{:.2f}", row.sum) : "",
                    has_frames ? fmt::format("{:.3f}", mean) : "",
                    has_frames ? fmt::format("{:.3f}", row.most) : "",
                    has_frames ? std::to_string(row.slowest) : ""});
  }
  return table({"stage", "", "#up to date", "#left, about", "#in all, s", "#mean, s", "#most, s",
                "#in frame"},
               rows);
}

/// Frames whose steps one limit ruled, by limit.
std::string limits(const ReportData& data) {
  std::map<std::string, std::vector<int>> frames;
  const auto simulated = data.rows.find(Step::simulate);
  if (simulated == data.rows.end()) return {};
  for (const auto& [frame, line] : simulated->second)
    if (const std::string limit = member_text(line, "limit"); !limit.empty())
      frames[limit].push_back(frame);
  std::vector<std::vector<std::string>> rows;
  for (const auto& [limit, ruled] : frames)
    rows.push_back(
        {html_text(limit), std::to_string(ruled.size()), html_text(format_frames(ruled))});
  return table({"what ruled the step", "#frames", "which"}, rows);
}

std::string plan(const ReportData& data) {
  std::vector<std::vector<std::string>> rows;
  const std::vector<Task>& tasks = data.plan.tasks;
  for (size_t begin = 0, end = 0; begin < tasks.size(); begin = end) {
    std::vector<int> frames;
    for (end = begin;
         end < tasks.size() && tasks[end].step == tasks[begin].step &&
         tasks[end].action == tasks[begin].action && tasks[end].reason == tasks[begin].reason;
         ++end)
      frames.push_back(tasks[end].frame);
    rows.push_back({html_text(step_name(tasks[begin].step)),
                    std::string(action_name(tasks[begin].action)),
                    is_per_frame(tasks[begin].step) ? html_text(format_frames(frames)) : "",
                    html_text(tasks[begin].reason)});
  }
  return table({"stage", "another run would", "frames", "because"}, rows);
}

std::string files(const ReportData& data) {
  std::map<std::string, std::pair<int, double>> kinds;  // files and bytes
  for (const auto& [file, record] : data.files) {
    auto& [count, bytes] = kinds[record.step];
    ++count;
    bytes += double(record.size);
  }
  std::vector<std::vector<std::string>> rows;
  for (const auto& [kind, size] : kinds)
    rows.push_back(
        {html_text(kind), std::to_string(size.first), fmt::format("{:.1f}", size.second / 1e6)});
  return table({"made by", "#files", "#MB"}, rows);
}

/// As a shell takes it.
std::string command_text(const json& run) {
  std::string text;
  const auto words = run.find("command");
  if (words == run.end() || !words->is_array()) return text;
  for (const json& word : *words) {
    if (!word.is_string()) continue;
    text += (text.empty() ? "" : " ") + shell_word(word.get<std::string>());
  }
  return text;
}

std::string runs(const ReportData& data) {
  constexpr size_t most = 20;
  std::vector<std::vector<std::string>> rows;
  const size_t first = data.runs.size() > most ? data.runs.size() - most : 0;
  for (size_t k = data.runs.size(); k-- > first;) {
    const json& run = data.runs[k];
    rows.push_back({html_text(member_text(run, "started")),
                    "<code>" + html_text(command_text(run)) + "</code>",
                    html_text(member_text(run, "host")), html_text(member_text(run, "cpu")),
                    member_text(run, "threads"), html_text(member_text(run, "version"))});
  }
  return table({"started", "command", "machine", "processor", "#threads", "version"}, rows);
}

/// What the script needs, and the rows as they were written.
std::string data_element(const ReportData& data, const PageImages& images) {
  json list = json::array();
  for (const PageImage& image : images.images) {
    json entry{{"frame", image.frame}, {"a", fmt::format("a{}", image.frame)}};
    if (!image.other.empty()) entry["b"] = fmt::format("b{}", image.frame);
    list.push_back(std::move(entry));
  }
  json rows = json::object();
  for (const auto& [step, lines] : data.rows)
    for (const auto& [frame, line] : lines) rows[std::string(step_name(step))].push_back(line);
  const json all{{"shot", data.job.shot.name},    {"fps", data.job.shot.timeline.fps},
                 {"a", data.job.folder.string()}, {"b", images.compared},
                 {"images", std::move(list)},     {"rows", std::move(rows)},
                 {"state", images.state}};
  std::string text = all.dump(-1, ' ', true, json::error_handler_t::replace);
  // "</script>" in a name must not end the element.
  for (size_t k = text.find('<'); k != text.npos; k = text.find('<', k))
    text.replace(k, 1, "\\u003c");
  std::string elements = fmt::format(
      "<div id=\"texts\" hidden><script type=\"application/json\" id=\"data\">{}</script>\n", text);
  for (const PageImage& image : images.images) {
    elements += fmt::format("<script type=\"text/plain\" id=\"a{}\">{}</script>\n", image.frame,
                            image.large);
    if (!image.other.empty())
      elements += fmt::format("<script type=\"text/plain\" id=\"b{}\">{}</script>\n", image.frame,
                              image.other);
  }
  return elements + "</div>\n";
}

std::string plots(const ReportData& data) {
  std::string text;
  for (const PlotSection& group : report_plots(data)) {
    std::string pictures;
    for (const Plot& plot : group.plots) pictures += svg_plot(plot);
    if (pictures.empty()) continue;
    std::string id = group.title;
    std::transform(id.begin(), id.end(), id.begin(),
                   [](char c) { return c == ' ' ? '-' : char(std::tolower(c)); });
    text += section(id, group.title, "<div class=\"plots\">" + pictures + "</div>\n");
  }
  return text;
}

}  // namespace

std::string report_page(const ReportData& data, const PageImages& images) {
  const bool live = !images.state.empty();
  std::string text = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{}</title>\n"
      "<link rel=\"icon\" href=\"data:,\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      // Whatever a name in the shot might say, the page asks nobody else and sends nothing.
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src {}; "
      "media-src {}; {}style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n"
      "<style>{}</style></head><body>\n",
      html_text(data.job.shot.name), live ? "'self' data:" : "data:", live ? "'self'" : "data:",
      live ? "connect-src 'self'; " : "", report_style);
  text += head(data, live) + "<main>\n";
  text += section("warnings", "Warnings of the last run", warnings(data));
  text += section("frames", "Frames", sheet(data, images));
  if (!images.movie.empty())
    text += section("movie", "Movie",
                    fmt::format("<video controls loop src=\"{}\"></video>\n", images.movie));
  text += section("stages", "Stages", stages(data));
  text += plots(data);
  text += section("limits", "Steps", limits(data));
  text += section("plan", "What is up to date, and what was left out", plan(data));
  text += section("files", "Files", files(data));
  text += section("runs", "Runs, the last first", runs(data));
  text += fmt::format("</main>\n<footer>{} by drench {}</footer>\n",
                      html_text(data.job.folder.string()), build_id::version);
  text +=
      "<dialog aria-label=\"frame\"><div class=\"stage\"><img alt=\"\"></div>"
      "<div class=\"bar\"><span></span><span>arrows, space, Z, B, Escape</span></div></dialog>\n";
  text += data_element(data, images);
  text += fmt::format("<script>{}</script>", report_script);
  if (live) text += fmt::format("<script>{}</script>", watch_script);
  return text + "</body></html>\n";
}

}  // namespace drench
