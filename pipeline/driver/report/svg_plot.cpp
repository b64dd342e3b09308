#include "pipeline/driver/report/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>

#include "pipeline/contract/shot/printable.h"

namespace drench {

namespace {

constexpr double width = 480, height = 200;                     // of the picture, px
constexpr double left = 58, right = 20, top = 36, bottom = 30;  // margins of the axes
constexpr auto colours = std::to_array<std::string_view>(
    {"#6ab7ff", "#ffb454", "#7fd962", "#f07178", "#c792ea", "#5ccfe6", "#e6e1cf"});

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  bool empty() const { return !(low <= high); }
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

std::string_view colour_of(size_t series) { return colours[series % colours.size()]; }

std::string number(double value) { return fmt::format("{:.4g}", value + 0.0); }

class Drawing {
 public:
  explicit Drawing(const Plot& plot);
  std::string text();

 private:
  bool shows(double value) const {
    return std::isfinite(value) && (!plot_.logarithmic || value > 0);
  }
  double place_x(double x) const {
    const double length = x_.high - x_.low;
    return left + (width - left - right) * (length > 0 ? (x - x_.low) / length : 0.5);
  }
  double place_y(double value) const {
    const double at = plot_.logarithmic ? std::log10(value) : value;
    const double length = y_.high - y_.low;
    return height - bottom - (height - top - bottom) * (length > 0 ? (at - y_.low) / length : 0.5);
  }
  void find_ranges();
  void add_axes();
  void add_lines(size_t k);
  void add_bars();
  void add_legend();
  double bar_width() const;

  const Plot& plot_;
  Range x_, y_;  // y_ of logarithms where the plot is logarithmic
  std::string text_;
};

Drawing::Drawing(const Plot& plot) : plot_(plot) { find_ranges(); }

void Drawing::find_ranges() {
  std::map<double, double> sums;  // of bars
  for (const PlotSeries& series : plot_.series)
    for (size_t i = 0; i < series.x.size(); ++i) {
      if (std::isfinite(series.x[i])) x_.add(series.x[i]);
      if (!shows(series.y[i])) continue;
      if (plot_.kind == Plot::Kind::stacked_bars) {
        sums[series.x[i]] += series.y[i];
      } else {
        y_.add(plot_.logarithmic ? std::log10(series.y[i]) : series.y[i]);
      }
    }
  for (const auto& [x, sum] : sums) y_.add(sum);
  if (y_.empty()) return;
  if (plot_.logarithmic) {
    y_ = {std::floor(y_.low), std::ceil(y_.high)};
    if (y_.low == y_.high) ++y_.high;
  } else {
    // From 0, but for what hardly varies far from it: there the variation is what is looked for.
    if (y_.low >= 0 && y_.low < 0.6 * y_.high) y_.low = 0;
    if (plot_.kind == Plot::Kind::stacked_bars) y_.low = 0;
    if (y_.low == y_.high) y_ = {std::min(0.0, y_.low), y_.high != 0 ? std::max(0.0, y_.high) : 1};
  }
  if (plot_.kind == Plot::Kind::stacked_bars) x_ = {x_.low - 0.5, x_.high + 0.5};
}

void Drawing::add_axes() {
  const auto line = [&](double y, const std::string& label) {
    text_ +=
        fmt::format(R"(<path class="grid" d="M{:.1f} {:.1f}H{:.1f}"/>)", left, y, width - right);
    text_ += fmt::format(R"(<text class="tick" x="{:.1f}" y="{:.1f}" text-anchor="end">{}</text>)",
                         left - 6, y + 4, label);
  };
  if (plot_.logarithmic) {
    const int every = std::max(1, int(std::ceil((y_.high - y_.low) / 6)));
    for (int power = int(y_.low); power <= int(y_.high); power += every)
      line(place_y(std::pow(10, power)), fmt::format("1e{}", power));
  } else {
    for (const double tick : round_ticks(y_.low, y_.high, 5)) line(place_y(tick), number(tick));
  }
  for (const double tick : round_ticks(x_.low, x_.high, 7))
    text_ +=
        fmt::format(R"(<text class="tick" x="{:.1f}" y="{:.1f}" text-anchor="middle">{}</text>)",
                    place_x(tick), height - bottom + 16, number(tick));
  text_ += fmt::format(R"(<text class="tick" x="{:.1f}" y="{:.1f}" text-anchor="end">{}</text>)",
                       width - right, height - 2, html_text(plot_.x_name));
}

void Drawing::add_lines(size_t k) {
  const PlotSeries& series = plot_.series[k];
  std::string path, dots;
  bool joined = false;
  for (size_t i = 0; i < series.x.size(); ++i) {
    if (!shows(series.y[i])) {
      joined = false;
      continue;
    }
    const double x = place_x(series.x[i]), y = place_y(series.y[i]);
    path += fmt::format("{}{:.1f} {:.1f}", joined ? 'L' : 'M', x, y);
    joined = true;
    constexpr size_t most_dots = 300;  // of a probe there are thousands of values
    if (series.x.size() <= most_dots)
      dots += fmt::format(
          R"(<circle cx="{:.1f}" cy="{:.1f}" r="3"><title>{} {}: {} {}{}{}</title></circle>)", x, y,
          html_text(plot_.x_name), number(series.x[i]), number(series.y[i]), html_text(plot_.unit),
          plot_.series.size() > 1 ? ", " : "",
          plot_.series.size() > 1 ? html_text(series.name) : "");
  }
  text_ += fmt::format(
      R"(<g fill="{0}" stroke="{0}"><path class="line" d="{1}"/><g class="dots">{2}</g></g>)",
      colour_of(k), path, dots);
}

double Drawing::bar_width() const {
  return std::max(1.0, 0.8 * (width - left - right) / std::max(1.0, x_.high - x_.low));
}

void Drawing::add_bars() {
  std::map<double, double> base;
  for (size_t k = 0; k < plot_.series.size(); ++k) {
    const PlotSeries& series = plot_.series[k];
    text_ += fmt::format(R"(<g fill="{}">)", colour_of(k));
    for (size_t i = 0; i < series.x.size(); ++i) {
      if (!shows(series.y[i])) continue;
      double& low = base[series.x[i]];
      const double y = place_y(low + series.y[i]);
      text_ += fmt::format(
          R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"><title>{} {}: {} {} {}</title></rect>)",
          place_x(series.x[i]) - bar_width() / 2, y, bar_width(), std::max(0.0, place_y(low) - y),
          html_text(plot_.x_name), number(series.x[i]), html_text(series.name), number(series.y[i]),
          html_text(plot_.unit));
      low += series.y[i];
    }
    text_ += "</g>";
  }
}

/// From the right, on the line of the title, or below it where both do not fit.
void Drawing::add_legend() {
  if (plot_.series.size() < 2) return;
  constexpr double letter = 6.2, gap = 10;  // px
  double length = 0;
  for (const PlotSeries& series : plot_.series) length += letter * double(series.name.size()) + gap;
  const double title = 7.5 * double(plot_.title.size() + plot_.unit.size() + 3);
  double x = width - right;
  const int y = length + title < x ? 14 : 27;
  for (size_t k = plot_.series.size(); k-- > 0;) {
    text_ += fmt::format(
        R"(<text class="legend" x="{:.1f}" y="{}" text-anchor="end" fill="{}">{}</text>)", x, y,
        colour_of(k), html_text(plot_.series[k].name));
    x -= letter * double(plot_.series[k].name.size()) + gap;
  }
}

std::string Drawing::text() {
  if (x_.empty() || y_.empty()) return {};
  const std::string unit = plot_.unit.empty() ? "" : fmt::format(" [{}]", html_text(plot_.unit));
  text_ = fmt::format(
      R"(<svg viewBox="0 0 {:.0f} {:.0f}" role="img" aria-label="{}"><text class="title" x="4" y="14">{}{}</text>)",
      width, height, html_text(plot_.title), html_text(plot_.title), unit);
  add_axes();
  if (plot_.kind == Plot::Kind::stacked_bars) {
    add_bars();
  } else {
    for (size_t k = 0; k < plot_.series.size(); ++k) add_lines(k);
  }
  add_legend();
  return text_ + "</svg>\n";
}

}  // namespace

std::string svg_plot(const Plot& plot) { return Drawing(plot).text(); }

std::vector<double> round_ticks(double low, double high, int most) {
  if (!(low < high) || most < 1) return low == high ? std::vector{low} : std::vector<double>{};
  double step = std::pow(10, std::floor(std::log10((high - low) / most)));
  for (const double factor : {1, 2, 5, 10}) {
    if (std::floor(high / (step * factor)) - std::ceil(low / (step * factor)) + 1 <= most) {
      step *= factor;
      break;
    }
  }
  std::vector<double> ticks;
  const double first = std::ceil(low / step - 1e-9), last = std::floor(high / step + 1e-9);
  for (double k = first; k <= last; ++k) ticks.push_back(k * step);
  return ticks;
}

std::string html_text(std::string_view text) {
  std::string html;
  for (const char c : printable(text, Lines::many)) {
    switch (c) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      case '"':
        html += "&quot;";
        break;
      case '\'':
        html += "&#39;";
        break;
      default:
        html += c;
    }
  }
  return html;
}

}  // namespace drench
