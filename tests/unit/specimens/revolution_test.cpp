// Which specimens look the same after a turn about their axis: the hard cases of finding poses.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "drivers/base/rng.h"
#include "drivers/base/units.h"
#include "reconstruction/specimens/specimen.h"

namespace scan {
namespace {

using Eigen::Vector3d;

// Largest distance between a specimen's surface and itself after a turn about z.
double LargestChangeByTurning(std::string_view name) {
  const auto specimen = std::move(*MakeSpecimen(name));
  const TriangleMesh surface = ExactSurface(*specimen, 0.5);
  double largest = 0;
  Rng rng(1);
  for (const Vector3d& p : surface.vertices) {
    const Eigen::AngleAxisd turn(rng.Uniform(0, 2 * kPi), Vector3d::UnitZ());
    largest = std::max(largest, std::abs(specimen->SignedDistance(turn * p)));
  }
  return largest;
}

TEST(Revolution, TomatoIsInvariant) {
  EXPECT_LT(LargestChangeByTurning("tomato"), 1e-4);
  EXPECT_LT(LargestChangeByTurning("tomato-flushed"), 1e-4);
}

TEST(Revolution, MushroomIsNearlyInvariant) {
  const double change = LargestChangeByTurning("mushroom");
  EXPECT_GT(change, 0.2);
  EXPECT_LT(change, 2);
}

TEST(Revolution, BentStalkEndsSixMillimetresOffTheAxis) {
  EXPECT_GT(LargestChangeByTurning("tomato-stalk"), 2);
  const auto specimen = std::move(*MakeSpecimen("tomato-stalk"));
  double off_axis = 0;
  for (const Vector3d& p : ExactSurface(*specimen, 0.5).vertices) {
    if (p.z() > 25) off_axis = std::max(off_axis, std::hypot(p.x(), p.y()));
  }
  EXPECT_GT(off_axis, 6);
}

TEST(Revolution, OthersAreNotInvariant) {
  EXPECT_GT(LargestChangeByTurning("beetle"), 3);
  EXPECT_GT(LargestChangeByTurning("orchid"), 3);
}

}  // namespace
}  // namespace scan
