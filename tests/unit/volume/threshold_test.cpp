#include "reconstruction/volume/threshold.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "drivers/base/rng.h"

namespace scan {
namespace {

// Classes of Gaussian-like grey values: {mean, share}.
Volume Mixture(const std::vector<std::pair<double, double>>& classes, double spread) {
  Volume volume;
  volume.size = {50, 40, 50};
  Rng rng(5);
  for (std::size_t v = 0; v < volume.voxels(); ++v) {
    double at = rng.Uniform();
    std::size_t c = 0;
    while (c + 1 < classes.size() && at > classes[c].second) at -= classes[c++].second;
    const double noise = rng.Uniform() + rng.Uniform() + rng.Uniform() - 1.5;
    volume.grey.push_back(static_cast<float>(classes[c].first + spread * noise));
  }
  return volume;
}

bool AnyBetween(const std::vector<double>& levels, double low, double high) {
  return std::any_of(levels.begin(), levels.end(), [&](double l) { return l > low && l < high; });
}

TEST(OtsuLevels, TwoClassesAreSplitBetweenThem) {
  const auto levels = OtsuLevels(Mixture({{10, 0.9}, {200, 0.1}}, 10), 1, 0);
  ASSERT_EQ(levels.size(), 1u);
  EXPECT_GT(levels[0], 30);
  EXPECT_LT(levels[0], 180);
}

TEST(OtsuLevels, RareClassGetsALevelOfItsOwn) {
  const auto levels = OtsuLevels(Mixture({{20, 0.3}, {65, 0.68}, {105, 0.02}}, 10), 3, 2);
  EXPECT_TRUE(std::is_sorted(levels.begin(), levels.end()));
  EXPECT_TRUE(AnyBetween(levels, 28, 57));
  EXPECT_TRUE(AnyBetween(levels, 79, 100));
}

TEST(OtsuLevels, OneHotVoxelDoesNotStretchTheBins) {
  Volume volume = Mixture({{10, 0.7}, {12, 0.3}}, 0.3);
  volume.grey[77] = 1e7f;
  EXPECT_TRUE(AnyBetween(OtsuLevels(volume, 3, 2), 10.5, 11.5));
}

TEST(OtsuLevels, OneValueHasNoLevel) {
  Volume volume;
  volume.size = {3, 3, 3};
  volume.grey.assign(27, 4.0f);
  EXPECT_TRUE(OtsuLevels(volume, 3, 2).empty());
  EXPECT_TRUE(OtsuLevels(Volume{}, 3, 2).empty());
}

TEST(MeansAbout, MeansOfBothSides) {
  Volume volume;
  volume.size = {2, 2, 1};
  volume.grey = {1, 3, 10, 20};
  const ClassMeans means = MeansAbout(volume, 10);
  EXPECT_DOUBLE_EQ(means.below, 2);
  EXPECT_DOUBLE_EQ(means.above, 15);
}

}  // namespace
}  // namespace scan
