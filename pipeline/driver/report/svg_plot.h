#pragma once
// Line plots and stacked bars as SVG, for a page that loads nothing.

#include <string>
#include <vector>

namespace drench {

struct PlotSeries {
  std::string name;
  std::vector<double> x, y;  // of one length; values that are not finite are left out
};

struct Plot {
  enum class Kind { lines, stacked_bars };
  std::string title, x_name, unit;
  std::vector<PlotSeries> series;  // of stacked bars: one bar for every x
  Kind kind = Kind::lines;
  bool logarithmic = false;  // values of 0 and less are left out
};

/// An <svg> element with axes, a legend if there are several series, and every value as a title.
/// Empty if there is no value.
std::string svg_plot(const Plot& plot);

/// Values 1, 2 or 5 times a power of ten apart, at most `most`, that lie in low ... high.
std::vector<double> round_ticks(double low, double high, int most);

/// Text as it may stand in HTML and SVG, in attributes too.
std::string html_text(std::string_view text);

}  // namespace drench
