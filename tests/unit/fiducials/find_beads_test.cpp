#include "reconstruction/fiducials/find_beads.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "drivers/base/rng.h"
#include "drivers/base/units.h"

namespace scan {
namespace {

double Uniform(double low, double high) {
  return low + (high - low) * *rc::gen::inRange(0, 1'000'001) / 1e6;
}

// A ball half in denser, half in thinner matter, blurred over about a voxel, with noise.
Volume BallVolume(const Eigen::Vector3d& centre, double radius_mm, double noise) {
  Volume volume;
  volume.size = {28, 26, 24};
  volume.spacing_mm = {0.11, 0.12, 0.13};
  volume.origin_mm = {-1.5, -1.5, -1.5};
  volume.grey.resize(volume.voxels());
  Rng rng(7);
  std::size_t v = 0;
  for (std::size_t k = 0; k < volume.size[2]; ++k)
    for (std::size_t j = 0; j < volume.size[1]; ++j)
      for (std::size_t i = 0; i < volume.size[0]; ++i, ++v) {
        const Eigen::Vector3d p =
            volume.origin_mm +
            volume.spacing_mm.cwiseProduct(Eigen::Vector3d(
                static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)));
        const double share =
            0.5 - 0.5 * std::erf(((p - centre).norm() - radius_mm) / (std::sqrt(2.0) * 0.08));
        const double beside = p.x() < centre.x() ? 0.1 : 0.5;
        volume.grey[v] =
            static_cast<float>(1000 * (share + (1 - share) * beside) + noise * rng.Normal());
      }
  return volume;
}

RC_GTEST_PROP(FitSphere, FindsAnyBall, ()) {
  const Eigen::Vector3d centre(Uniform(-50, 50), Uniform(-50, 50), Uniform(-50, 50));
  const double radius = Uniform(0.1, 5);
  std::vector<Eigen::Vector3d> points;
  Rng rng(3);
  for (int i = 0; i < 60; ++i) {
    const double x = rng.Normal(), y = rng.Normal(), z = rng.Normal();
    points.push_back(centre + radius * Eigen::Vector3d(x, y, z).normalized());
  }
  points[5] += 0.4 * radius * Eigen::Vector3d(1, 0.3, -0.5);  // one that is not on it
  const auto bead = FitSphere(points);
  RC_ASSERT(bead.has_value());
  RC_ASSERT((bead->centre - centre).norm() < 1e-5 * radius);
  RC_ASSERT(std::abs(bead->radius_mm - radius) < 1e-5 * radius);
}

TEST(FitSphere, PointsInAPlaneAreNoBall) {
  EXPECT_FALSE(FitSphere({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}}));
}

TEST(FindBeads, CentresAreFoundToAFractionOfAVoxelWhereverTheyLie) {
  for (int trial = 0; trial < 8; ++trial) {
    Rng rng(static_cast<std::uint64_t>(trial));
    const double x = rng.Uniform(), y = rng.Uniform(), z = rng.Uniform();
    const Eigen::Vector3d centre = Eigen::Vector3d(0.05, 0.1, 0) + 0.12 * Eigen::Vector3d(x, y, z);
    const auto beads = FindBeads(BallVolume(centre, 0.5, 25), {.diameter_mm = 1.0});
    ASSERT_TRUE(beads) << ToString(beads.error());
    ASSERT_EQ(beads->size(), 1u);
    EXPECT_LT(((*beads)[0].centre - centre).norm(), 0.012) << trial;
    EXPECT_NEAR((*beads)[0].radius_mm, 0.5, 0.02);
  }
}

TEST(FindBeads, SaysWhatComesNearest) {
  // A rod of the ball's volume.
  Volume volume = BallVolume({0, 0, 0}, 0.5, 0);
  std::size_t v = 0;
  for (std::size_t k = 0; k < volume.size[2]; ++k)
    for (std::size_t j = 0; j < volume.size[1]; ++j)
      for (std::size_t i = 0; i < volume.size[0]; ++i, ++v)
        volume.grey[v] = i >= 11 && i < 14 && j >= 10 && j < 14 && k > 2 && k < 22 ? 900 : 100;
  const auto beads = FindBeads(volume, {.diameter_mm = 1.0});
  ASSERT_FALSE(beads);
  EXPECT_NE(ToString(beads.error()).find("no ball of 1 mm"), std::string::npos)
      << ToString(beads.error());
  EXPECT_FALSE(FindBeads(volume, {.diameter_mm = 0.3}));
  EXPECT_FALSE(FindBeads({}, {.diameter_mm = 1.0}));
}

}  // namespace
}  // namespace scan
