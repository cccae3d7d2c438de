#include "reconstruction/report/plot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "reconstruction/report/pose_plots.h"

namespace scan {
namespace {

using Eigen::Vector2d;

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

cv::Vec3b ColourAt(const cv::Mat& picture, const Vector2d& px) {
  return picture.at<cv::Vec3b>(static_cast<int>(px.y()), static_cast<int>(px.x()));
}
bool Coloured(const cv::Vec3b& c) {
  const auto [low, high] = std::minmax({c[0], c[1], c[2]});
  return high > low + 60;
}

TEST(Ticks, StandAtRoundNumbers) {
  EXPECT_EQ(LinearTicks(0, 10, 5, false), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  const auto half = LinearTicks(-0.6, 1.1, 4, false);
  ASSERT_EQ(half.size(), 4u);
  EXPECT_NEAR(half.front(), -0.5, 1e-12);
  EXPECT_EQ(LinearTicks(0.6, 3.4, 10, true), (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(LogTicks(-2.5, 6, 9), (std::vector<double>{-2, -1, 0, 1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(LogTicks(-6, 12, 9).size(), 10u);
  const auto fine = LogTicks(-0.1, 1.1, 8);  // 1, 2, 5, 10
  ASSERT_EQ(fine.size(), 4u);
  EXPECT_NEAR(fine[1], std::log10(2), 1e-12);
  const auto narrow = LogTicks(std::log10(0.93), std::log10(1.31), 8);
  ASSERT_GE(narrow.size(), 4u);
  EXPECT_NEAR(std::pow(10, narrow.front()), 0.95, 1e-9);
  EXPECT_TRUE(LinearTicks(1, 1, 5, false).empty());
  EXPECT_TRUE(LogTicks(0, kNotANumber, 5).empty());
}

TEST(DrawPlot, MarksStandWhereTheFrameSays) {
  Plot plot;
  plot.x = {.label = "sigma, deg", .log = true};
  plot.y = {.label = "error, mm", .from_zero = true};
  plot.series = {{"with", {{0.01, 1}, {0.1, 2}, {1, 4}}}, {"without", {{0.01, 3}, {1, 3}}}};
  const DrawnPlot drawn = DrawPlot(plot, {480, 300});
  ASSERT_EQ(drawn.picture.size(), cv::Size(480, 300));
  for (const Vector2d& point : plot.series[0].points) {
    EXPECT_TRUE(Coloured(ColourAt(drawn.picture, drawn.frame(point))));
    EXPECT_TRUE(drawn.frame.box_px.contains(cv::Point(static_cast<int>(drawn.frame(point).x()),
                                                      static_cast<int>(drawn.frame(point).y()))));
  }
  // Between the marks of the second there is its line, beside it there is none.
  const Vector2d middle = 0.5 * (drawn.frame({0.01, 3}) + drawn.frame({0.1, 3}));
  EXPECT_TRUE(Coloured(ColourAt(drawn.picture, middle)));
  EXPECT_FALSE(Coloured(ColourAt(drawn.picture, middle + Vector2d(0, 8))));
  // Powers of ten are equally far apart, up is more, zero is the floor.
  EXPECT_NEAR(drawn.frame({0.1, 0}).x() - drawn.frame({0.01, 0}).x(),
              drawn.frame({1, 0}).x() - drawn.frame({0.1, 0}).x(), 1e-9);
  EXPECT_LT(drawn.frame({1, 4}).y(), drawn.frame({1, 1}).y());
  EXPECT_NEAR(drawn.frame({1, 0}).y(), drawn.frame.box_px.br().y, 1e-9);
}

TEST(DrawPlot, NothingIsDrawnOfNothingAndNothingOfWhatIsNotFinite) {
  EXPECT_TRUE(DrawPlot({}, {480, 300}).picture.empty());
  Plot plot;
  plot.y.log = true;
  plot.series = {{"", {{1, 0}, {2, -3}, {kNotANumber, 1}, {1, kNotANumber}}}};
  EXPECT_TRUE(DrawPlot(plot, {480, 300}).picture.empty());
  plot.series = {{"", {{1, 10}, {2, 20}}}};
  const DrawnPlot clean = DrawPlot(plot, {480, 300});
  plot.series[0].points.insert(plot.series[0].points.begin(), {3, -1});
  plot.series[0].points.emplace_back(kNotANumber, 5);
  plot.guides = {{PlotGuide::At::y, 0, "of no logarithm"}, {PlotGuide::At::x, kNotANumber, ""}};
  EXPECT_EQ(cv::norm(DrawPlot(plot, {480, 300}).picture, clean.picture, cv::NORM_INF), 0);
}

TEST(DrawPlot, OnePointIsEnough) {
  Plot plot;
  plot.series = {{"", {{3, 7}}}};
  const DrawnPlot drawn = DrawPlot(plot, {240, 160});
  ASSERT_FALSE(drawn.picture.empty());
  EXPECT_TRUE(Coloured(ColourAt(drawn.picture, drawn.frame({3, 7}))));
}

PoseDiagnostics Solve() {
  PoseDiagnostics solve;
  solve.steps = {{900, 20, 64, 3, true}, {400, 0.2, 8, 1, false}, {410, 0.05, 16, 1, true}};
  solve.converged_px = 0.01;
  solve.solve = {"solve", {{1.0, "v1 lift", 0.9}, {40, "mask bias", 0.7}, {1e6, "CT scale", 0.5}}};
  solve.placings = {{"m0", {{0.1, "turn z", 0.98}, {50, "shift x", 0.6}}}};
  return solve;
}

TEST(PosePlots, ShowEveryStepAndWhereTheSolveBeganAgain) {
  const Plot plot = ConvergencePlot(Solve());
  ASSERT_EQ(plot.series.size(), 3u);
  EXPECT_EQ(plot.series[0].points[1], Vector2d(2, 8));
  EXPECT_EQ(plot.series[1].points[2], Vector2d(3, 0.05));
  EXPECT_EQ(plot.series[2].points[0], Vector2d(1, 3));
  ASSERT_EQ(plot.guides.size(), 2u);
  EXPECT_EQ(plot.guides[0].value, 2.5);
  EXPECT_EQ(plot.guides[1].value, 0.01);
  EXPECT_EQ(CostPlot(Solve()).series[0].points[1], Vector2d(2, 400));
  EXPECT_FALSE(DrawPlot(plot, {480, 300}).picture.empty());
  EXPECT_TRUE(DrawPlot(ConvergencePlot({}), {480, 300}).picture.empty());
}

TEST(PosePlots, NameWhatIsLeastDetermined) {
  EXPECT_EQ(LeastDetermined(Solve().solve, 2), "v1 lift (1), mask bias (40)");
  EXPECT_EQ(LeastDetermined({}, 2), "");
  EXPECT_EQ(HardlyInformed(Solve().solve), 1u);
  EXPECT_EQ(HardlyInformed({}), 0u);
  EXPECT_EQ(SpectrumPlot(Solve().solve).series[0].points[2], Vector2d(3, 1e6));
  const Plot placing = PlacingPlot(Solve().placings);
  ASSERT_EQ(placing.series.size(), 1u);
  EXPECT_EQ(placing.series[0].labels[0], "turn z");
  EXPECT_TRUE(DrawPlot(PlacingPlot({}), {480, 300}).picture.empty());
}

}  // namespace
}  // namespace scan
