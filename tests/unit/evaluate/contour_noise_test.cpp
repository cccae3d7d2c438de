#include "reconstruction/evaluate/contour_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "drivers/base/units.h"

namespace scan {
namespace {

// Clockwise on the screen: an outer contour; the other way: a hole.
Contour Circle(const Eigen::Vector2d& centre, double radius, bool hole = false) {
  Contour contour;
  contour.hole = hole;
  constexpr int kPoints = 2000;
  for (int i = 0; i < kPoints; ++i) {
    const double angle = (hole ? -2 : 2) * kPi * i / kPoints;
    const Eigen::Vector2d out(std::cos(angle), std::sin(angle));
    contour.points.push_back({centre + radius * out, hole ? Eigen::Vector2d(-out) : out, 0});
  }
  return contour;
}

double AreaOf(const cv::Mat& coverage) { return cv::sum(coverage)[0] / 255; }

double AreaOf(std::initializer_list<Contour> contours) {
  return AreaOf(CoverageOfContours(std::vector<Contour>(contours), cv::Size(120, 90)));
}

TEST(CoverageOfContours, HasTheAreaOfDiscsAndRings) {
  const double area = kPi * 30 * 30;
  EXPECT_NEAR(AreaOf({Circle({60.3, 44.8}, 30)}), area, 1);
  EXPECT_NEAR(AreaOf({Circle({60.3, 44.8}, 30), Circle({55, 40}, 10, true)}), area - kPi * 100, 1);
  EXPECT_EQ(AreaOf({}), 0);
}

TEST(CoverageOfContours, OverlapsCountOnceAndInvertedPiecesNot) {
  // Two discs with a common lens.
  const double r = 20, d = 24;
  const double lens = 2 * r * r * std::acos(d / (2 * r)) - d / 2 * std::sqrt(4 * r * r - d * d);
  EXPECT_NEAR(AreaOf({Circle({40, 45}, r), Circle({40 + d, 45}, r)}), 2 * kPi * r * r - lens, 1);
  EXPECT_EQ(AreaOf({Circle({40, 45}, 12, true)}), 0);  // a hole in nothing
}

TEST(CoverageOfContours, IsCutAtThePicture) {
  EXPECT_NEAR(AreaOf({Circle({0, 45}, 20)}), kPi * 200, 1);
  EXPECT_NEAR(AreaOf({Circle({60, 90}, 20)}), kPi * 200, 1);
  EXPECT_NEAR(AreaOf({Circle({60, 45}, 500)}), 120 * 90, 1e-6);
}

TEST(DisplacedContours, BiasSwellsOuterContoursAndShrinksHoles) {
  const std::vector<Contour> ring{Circle({60, 45}, 30), Circle({60, 45}, 12, true)};
  ContourNoise noise;
  noise.bias_px = 0.7;
  Rng rng(1);
  const auto moved = DisplacedContours(ring, noise, rng);
  ASSERT_EQ(moved.size(), 2u);
  for (const ContourPoint& p : moved[0].points)
    EXPECT_NEAR((p.position - Eigen::Vector2d(60, 45)).norm(), 30.7, 1e-3);
  for (const ContourPoint& p : moved[1].points)
    EXPECT_NEAR((p.position - Eigen::Vector2d(60, 45)).norm(), 11.3, 1e-3);
}

TEST(DisplacedContours, NoiseHasTheStatedVarianceAndCorrelation) {
  const std::vector<Contour> circle{Circle({0, 0}, 3000)};
  ContourNoise noise;
  noise.sigma_px = 0.5;
  noise.correlation_px = 4;
  Rng rng(5);
  const auto moved = DisplacedContours(circle, noise, rng);
  std::vector<double> r;
  for (const ContourPoint& p : moved[0].points) r.push_back(p.position.norm() - 3000);
  const auto n = r.size();
  const double step_px = 2 * kPi * 3000 / static_cast<double>(n);
  const auto product = [&](std::size_t lag) {
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) sum += r[i] * r[(i + lag) % n];
    return sum / static_cast<double>(n);
  };
  EXPECT_NEAR(std::accumulate(r.begin(), r.end(), 0.0) / static_cast<double>(n), 0, 0.03);
  const double variance = product(0);
  EXPECT_NEAR(std::sqrt(variance), 0.5, 0.02);
  double integral = step_px;
  for (std::size_t lag = 1; lag * step_px < 8; ++lag)
    integral += 2 * step_px * product(lag) / variance;
  EXPECT_NEAR(integral, 4, 0.6);
}

}  // namespace
}  // namespace scan
