// Plots of numbers: lines, stems and marks over two axes.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace scan {

struct PlotAxis {
  std::string label;       // with the unit; ASCII
  bool log = false;        // of base ten; what is not positive is left out
  bool whole = false;      // ticks at whole numbers only
  bool from_zero = false;  // zero is shown; without meaning on a log axis
};

struct PlotSeries {
  enum class Style { line, stem, marks };  // a line has marks where its points are few
  std::string name;                        // in the legend; none when empty
  std::vector<Eigen::Vector2d> points;     // not finite ones interrupt the line
  Style style = Style::line;
  std::vector<std::string> labels = {};  // of the first points, above them
};

// A thin line across the plot, at y or at x.
struct PlotGuide {
  enum class At { x, y };
  At at = At::y;
  double value = 0;
  std::string label;
};

struct Plot {
  PlotAxis x, y;
  std::vector<PlotSeries> series;
  std::vector<PlotGuide> guides;
};

// Where the drawn plot shows what.
struct PlotFrame {
  Eigen::Vector2d low, high;  // of the axes; their logarithms on log axes
  bool log_x = false, log_y = false;
  cv::Rect box_px;

  // Pixel of a point; positive in the directions that are logarithmic.
  Eigen::Vector2d operator()(const Eigen::Vector2d& point) const;
};

struct DrawnPlot {
  cv::Mat picture;  // BGR on white; empty when there is no point to draw
  PlotFrame frame;
};

// Legend above, at most eight series in colours of their own, ticks at round numbers.
// Precondition: at least 240 x 160.
DrawnPlot DrawPlot(const Plot& plot, cv::Size size);

// Round numbers within [low, high], at most about `count`. Linear: steps of 1, 2 or 5 times a power
// of ten. Logarithmic (low and high are logarithms of base ten, as is what is returned): powers of
// ten, with twice and five times as much in between where these are few, linear ones where even
// those are less than two.
std::vector<double> LinearTicks(double low, double high, int count, bool whole);
std::vector<double> LogTicks(double low, double high, int count);

}  // namespace scan
