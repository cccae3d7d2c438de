#include "reconstruction/report/plot.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace scan {
namespace {

using Eigen::Vector2d;

constexpr int kPlotShift = 4;  // fraction bits of OpenCV's drawing
constexpr double kFontScale = 0.42;
constexpr int kLegendRowPx = 18, kLegendMarkPx = 22;
const cv::Scalar kTextInk(50, 50, 50), kFrameInk(120, 120, 120), kGrid(228, 228, 228),
    kGuideInk(150, 150, 150);
// Okabe and Ito's colours, told apart by all kinds of sight; BGR.
const std::array<cv::Scalar, 8> kSeriesInk{cv::Scalar(178, 114, 0),   cv::Scalar(0, 94, 213),
                                           cv::Scalar(115, 158, 0),   cv::Scalar(60, 60, 60),
                                           cv::Scalar(167, 121, 204), cv::Scalar(0, 159, 230),
                                           cv::Scalar(40, 40, 150),   cv::Scalar(233, 180, 86)};

double LogOf(double value) { return value > 0 ? std::log10(value) : std::nan(""); }

Vector2d OnAxes(const Plot& plot, const Vector2d& point) {
  return {plot.x.log ? LogOf(point.x()) : point.x(), plot.y.log ? LogOf(point.y()) : point.y()};
}

cv::Point FixedPoint(const Vector2d& px) {
  const auto fixed = [](double v) {
    return static_cast<int>(std::lround((v - 0.5) * (1 << kPlotShift)));
  };
  return {fixed(px.x()), fixed(px.y())};
}

void Segment(cv::Mat& picture, const Vector2d& a, const Vector2d& b, const cv::Scalar& ink) {
  cv::line(picture, FixedPoint(a), FixedPoint(b), ink, 1, cv::LINE_AA, kPlotShift);
}

cv::Size SizeOf(const std::string& text) {
  int baseline = 0;
  return cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, kFontScale, 1, &baseline);
}

// `at` is the left end of the base line.
void Write(cv::Mat& picture, cv::Point at, const std::string& text, const cv::Scalar& ink) {
  cv::putText(picture, text, at, cv::FONT_HERSHEY_SIMPLEX, kFontScale, ink, 1, cv::LINE_AA);
}

// Circle, square, triangle, cross: series differ without colour, too.
void Mark(cv::Mat& picture, const Vector2d& at, std::size_t series, const cv::Scalar& ink) {
  constexpr double kHalf = 3.5;
  const auto corner = [&](double x, double y) { return Vector2d(at + kHalf * Vector2d(x, y)); };
  switch (series % 4) {
    case 0:
      cv::circle(picture, FixedPoint(at), 3 << kPlotShift, ink, cv::FILLED, cv::LINE_AA,
                 kPlotShift);
      return;
    case 1:
      cv::rectangle(picture, FixedPoint(corner(-0.9, -0.9)), FixedPoint(corner(0.9, 0.9)), ink, 1,
                    cv::LINE_AA, kPlotShift);
      return;
    case 2:
      Segment(picture, corner(0, -1.1), corner(1, 0.9), ink);
      Segment(picture, corner(1, 0.9), corner(-1, 0.9), ink);
      Segment(picture, corner(-1, 0.9), corner(0, -1.1), ink);
      return;
    default:
      Segment(picture, corner(-1, -1), corner(1, 1), ink);
      Segment(picture, corner(-1, 1), corner(1, -1), ink);
  }
}

struct Range {
  double low, high;
};

// Of everything that is drawn, with a margin; nothing where there is nothing.
std::optional<Range> RangeOf(const Plot& plot, int axis) {
  std::optional<Range> range;
  const auto extend = [&range](double v) {
    if (!range) range = Range{v, v};
    range = Range{std::min(range->low, v), std::max(range->high, v)};
  };
  for (const PlotSeries& series : plot.series)
    for (const Vector2d& point : series.points) {
      const Vector2d at = OnAxes(plot, point);
      if (at.allFinite()) extend(at[axis]);
    }
  if (!range) return range;
  const PlotAxis& shown = axis == 0 ? plot.x : plot.y;
  for (const PlotGuide& guide : plot.guides) {
    if ((guide.at == PlotGuide::At::x) != (axis == 0)) continue;
    const double v = shown.log ? LogOf(guide.value) : guide.value;
    if (std::isfinite(v)) extend(v);
  }
  const bool zero = shown.from_zero && !shown.log;
  if (zero) extend(0);
  double margin = 0.08 * (range->high - range->low);
  if (margin <= 1e-9 * std::max(1.0, std::abs(range->high))) margin = shown.log ? 0.3 : 0.5;
  const bool at_zero = zero && range->low == 0;
  return Range{range->low - (at_zero && axis == 1 ? 0 : margin), range->high + margin};
}

std::string TickText(double value, bool log) {
  const double v = log ? std::pow(10, value) : value;
  if (log && (v > 9000 || v < 1e-3)) {
    const double power = std::floor(value + 1e-9);
    return fmt::format("{:.0f}e{:.0f}", std::pow(10, value - power), power);
  }
  if (std::abs(v) >= 1e5 || (v != 0 && std::abs(v) < 1e-3)) return fmt::format("{:.0e}", v);
  return fmt::format("{:.6g}", std::abs(v) < 1e-12 ? 0.0 : v);
}

// Rows of legend entries that fit into the width: for each series the row and the place in it.
struct LegendPlaces {
  std::vector<cv::Point> at;  // left end, row from 0
  int rows = 0;
};
LegendPlaces PlaceLegend(const Plot& plot, int width) {
  LegendPlaces places;
  int x = 0;
  for (const PlotSeries& series : plot.series) {
    if (series.name.empty()) {
      places.at.emplace_back(0, -1);
      continue;
    }
    const int wide = kLegendMarkPx + SizeOf(series.name).width + 16;
    if (places.rows == 0 || x + wide > width) {
      ++places.rows;
      x = 0;
    }
    places.at.emplace_back(x, places.rows - 1);
    x += wide;
  }
  return places;
}

class PlotDrawing {
 public:
  PlotDrawing(const Plot& plot, cv::Size size, Range x, Range y, const LegendPlaces& legend)
      : plot_(plot), picture_(size, CV_8UC3, cv::Scalar::all(255)) {
    frame_.low = {x.low, y.low};
    frame_.high = {x.high, y.high};
    frame_.log_x = plot.x.log;
    frame_.log_y = plot.y.log;
    y_ticks_ =
        plot.y.log ? LogTicks(y.low, y.high, 8) : LinearTicks(y.low, y.high, 7, plot.y.whole);
    int widest = 0;
    for (const double tick : y_ticks_)
      widest = std::max(widest, SizeOf(TickText(tick, plot.y.log)).width);
    const int left = widest + 16, top = 30 + kLegendRowPx * legend.rows, bottom = 44, right = 18;
    frame_.box_px = {left, top, size.width - left - right, size.height - top - bottom};
  }

  void DrawAxes();
  void DrawGuides();
  void DrawSeries(std::size_t index);
  void DrawLegend(const LegendPlaces& places);
  DrawnPlot Done() && { return {std::move(picture_), frame_}; }

 private:
  double XPx(double on_axis) const {
    return frame_.box_px.x +
           frame_.box_px.width * (on_axis - frame_.low.x()) / (frame_.high.x() - frame_.low.x());
  }
  double YPx(double on_axis) const {
    return frame_.box_px.y +
           frame_.box_px.height * (frame_.high.y() - on_axis) / (frame_.high.y() - frame_.low.y());
  }
  double left() const { return frame_.box_px.x; }
  double right() const { return frame_.box_px.x + frame_.box_px.width; }
  double top() const { return frame_.box_px.y; }
  double bottom() const { return frame_.box_px.y + frame_.box_px.height; }

  const Plot& plot_;
  cv::Mat picture_;
  PlotFrame frame_;
  std::vector<double> y_ticks_;
};

void PlotDrawing::DrawAxes() {
  const int wide_tick = 60;
  const int count = std::max(2, frame_.box_px.width / wide_tick);
  const auto x_ticks = plot_.x.log
                           ? LogTicks(frame_.low.x(), frame_.high.x(), count)
                           : LinearTicks(frame_.low.x(), frame_.high.x(), count, plot_.x.whole);
  for (const double tick : x_ticks) {
    const double x = XPx(tick);
    Segment(picture_, {x, top()}, {x, bottom()}, kGrid);
    Segment(picture_, {x, bottom()}, {x, bottom() + 4}, kFrameInk);
    const std::string text = TickText(tick, plot_.x.log);
    Write(picture_, {static_cast<int>(x) - SizeOf(text).width / 2, static_cast<int>(bottom()) + 17},
          text, kTextInk);
  }
  for (const double tick : y_ticks_) {
    const double y = YPx(tick);
    Segment(picture_, {left(), y}, {right(), y}, kGrid);
    Segment(picture_, {left() - 4, y}, {left(), y}, kFrameInk);
    const std::string text = TickText(tick, plot_.y.log);
    Write(picture_, {static_cast<int>(left()) - 8 - SizeOf(text).width, static_cast<int>(y) + 4},
          text, kTextInk);
  }
  cv::rectangle(picture_, frame_.box_px, kFrameInk);
  const cv::Size label = SizeOf(plot_.x.label);
  Write(picture_,
        {std::max(4, static_cast<int>(right()) - label.width), static_cast<int>(bottom()) + 36},
        plot_.x.label, kTextInk);
  Write(picture_, {6, static_cast<int>(top()) - 10}, plot_.y.label, kTextInk);
}

void PlotDrawing::DrawGuides() {
  for (const PlotGuide& guide : plot_.guides) {
    const bool at_x = guide.at == PlotGuide::At::x;
    const double v = (at_x ? plot_.x.log : plot_.y.log) ? LogOf(guide.value) : guide.value;
    if (!std::isfinite(v)) continue;
    const Vector2d a = at_x ? Vector2d(XPx(v), top()) : Vector2d(left(), YPx(v));
    const Vector2d b = at_x ? Vector2d(XPx(v), bottom()) : Vector2d(right(), YPx(v));
    constexpr double kDash = 5, kPeriod = 9;
    const double length = (b - a).norm();
    for (double at = 0; at < length; at += kPeriod)
      Segment(picture_, a + (b - a) * (at / length),
              a + (b - a) * (std::min(at + kDash, length) / length), kGuideInk);
    const cv::Size size = SizeOf(guide.label);
    const cv::Point where =
        at_x ? cv::Point(std::min(static_cast<int>(a.x()) + 4,
                                  static_cast<int>(right()) - size.width - 2),
                         static_cast<int>(top()) + 14)
             : cv::Point(static_cast<int>(right()) - size.width - 6, static_cast<int>(a.y()) - 5);
    Write(picture_, where, guide.label, kGuideInk);
  }
}

void PlotDrawing::DrawSeries(std::size_t index) {
  constexpr std::size_t kManyPoints = 60;
  const PlotSeries& series = plot_.series[index];
  const cv::Scalar& ink = kSeriesInk[index % kSeriesInk.size()];
  std::optional<Vector2d> before;
  for (std::size_t i = 0; i < series.points.size(); ++i) {
    const Vector2d on_axes = OnAxes(plot_, series.points[i]);
    if (!on_axes.allFinite()) {
      before.reset();
      continue;
    }
    const Vector2d at(XPx(on_axes.x()), YPx(on_axes.y()));
    if (series.style == PlotSeries::Style::line && before) Segment(picture_, *before, at, ink);
    if (series.style == PlotSeries::Style::stem) Segment(picture_, {at.x(), bottom()}, at, ink);
    if (series.points.size() <= kManyPoints || series.style == PlotSeries::Style::marks)
      Mark(picture_, at, index, ink);
    before = at;
    if (i < series.labels.size() && !series.labels[i].empty()) {
      const int half = SizeOf(series.labels[i]).width / 2;
      const int x = std::clamp(static_cast<int>(at.x()) - half, static_cast<int>(left()) + 2,
                               static_cast<int>(right()) - 2 * half - 2);
      Write(picture_, {x, static_cast<int>(at.y()) - 8}, series.labels[i], ink);
    }
  }
}

void PlotDrawing::DrawLegend(const LegendPlaces& places) {
  for (std::size_t i = 0; i < plot_.series.size(); ++i) {
    if (places.at[i].y < 0) continue;
    const cv::Scalar& ink = kSeriesInk[i % kSeriesInk.size()];
    const double x = left() + places.at[i].x, y = 12 + kLegendRowPx * places.at[i].y;
    if (plot_.series[i].style != PlotSeries::Style::marks)
      Segment(picture_, {x, y}, {x + kLegendMarkPx - 4, y}, ink);
    Mark(picture_, {x + 0.5 * (kLegendMarkPx - 4), y}, i, ink);
    Write(picture_, {static_cast<int>(x) + kLegendMarkPx, static_cast<int>(y) + 4},
          plot_.series[i].name, kTextInk);
  }
}

}  // namespace

Vector2d PlotFrame::operator()(const Vector2d& point) const {
  const Vector2d at(log_x ? std::log10(point.x()) : point.x(),
                    log_y ? std::log10(point.y()) : point.y());
  const Vector2d share = (at - low).cwiseQuotient(high - low);
  return {box_px.x + box_px.width * share.x(), box_px.y + box_px.height * (1 - share.y())};
}

std::vector<double> LinearTicks(double low, double high, int count, bool whole) {
  std::vector<double> ticks;
  if (!(high > low) || !std::isfinite(high - low) || count < 1) return ticks;
  const double least = (high - low) / count;
  const double power = std::pow(10.0, std::floor(std::log10(least) + 1e-9));
  const double lead = least / power - 1e-9;
  double step = power * (lead <= 1 ? 1 : lead <= 2 ? 2 : lead <= 5 ? 5 : 10);
  if (whole) step = std::max(step, 1.0);
  const double slack = 1e-9 * step;
  for (double k = std::ceil((low - slack) / step); k * step <= high + slack; ++k)
    ticks.push_back(k * step);
  return ticks;
}

std::vector<double> LogTicks(double low, double high, int count) {
  std::vector<double> ticks;
  if (!(high > low) || !std::isfinite(high - low) || count < 1) return ticks;
  const double decades = high - low;
  // Between powers of ten only where two of these need not be in sight.
  const bool fine = decades < count / 3.0;
  const double step = fine ? 1 : std::max(1.0, std::ceil(decades / count));
  constexpr double kSlack = 1e-9;
  for (double k = std::floor(low / step) * step; k <= high + kSlack; k += step)
    for (const double factor : {1.0, 2.0, 5.0}) {
      if (factor > 1 && !fine) break;
      const double tick = k + std::log10(factor);
      if (tick >= low - kSlack && tick <= high + kSlack) ticks.push_back(tick);
    }
  if (ticks.size() >= 2) return ticks;
  // Less than a step of these: linear ones.
  ticks.clear();
  for (const double tick : LinearTicks(std::pow(10, low), std::pow(10, high), count, false))
    ticks.push_back(std::log10(tick));
  return ticks;
}

DrawnPlot DrawPlot(const Plot& plot, cv::Size size) {
  assert(size.width >= 240 && size.height >= 160);
  const auto x = RangeOf(plot, 0), y = RangeOf(plot, 1);
  if (!x || !y) return {};
  const LegendPlaces legend = PlaceLegend(plot, size.width - 80);
  PlotDrawing drawing(plot, size, *x, *y, legend);
  drawing.DrawAxes();
  drawing.DrawGuides();
  for (std::size_t i = 0; i < plot.series.size(); ++i) drawing.DrawSeries(i);
  drawing.DrawLegend(legend);
  return std::move(drawing).Done();
}

}  // namespace scan
