#include "reconstruction/volume/segment.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <array>
#include <cmath>

#include "tests/support/solid_volume.h"

namespace scan {
namespace {

using Eigen::Vector3d;

double Ball(const Vector3d& p, const Vector3d& centre, double radius) {
  return (p - centre).norm() - radius;
}

// A specimen in a tube filled with fluid: fluid brighter than air, the wall as bright as the
// specimen, the volume's corners air.
Volume InTube(double fluid, double noise) {
  SolidVolume shape;
  shape.size = {56, 56, 40};
  shape.spacing_mm = Vector3d::Ones();
  shape.blur_mm = 1;
  shape.noise = noise;
  Volume volume = MakeSolidVolume(
      shape,
      [](const Vector3d& p) {
        return Ball(p, {2, -3, 1}, 9);
      },
      [](double) { return 150.0; });
  Rng rng(2);
  for (std::size_t k = 0; k < 40; ++k)
    for (std::size_t j = 0; j < 56; ++j)
      for (std::size_t i = 0; i < 56; ++i) {
        const double r = std::hypot(static_cast<double>(i) - 27.5, static_cast<double>(j) - 27.5);
        float& g = volume.grey[volume.index(i, j, k)];
        if (r < 28) g = std::max(g, static_cast<float>(fluid + rng.Uniform(-noise, noise)));
        if (r > 25.5 && r < 28) g = 150;
      }
  return volume;
}

Segmentation SegmentOrDie(const Volume& volume, const SegmentOptions& options = {}) {
  auto s = Segment(volume, options);
  EXPECT_TRUE(s) << ToString(s.error());
  return s ? std::move(*s) : Segmentation{};
}

// Gives the voxels low..high - 1 one grey value.
void SetBlock(Volume& volume, const std::array<std::size_t, 3>& low,
              const std::array<std::size_t, 3>& high, float grey) {
  for (std::size_t k = low[2]; k < high[2]; ++k)
    for (std::size_t j = low[1]; j < high[1]; ++j)
      for (std::size_t i = low[0]; i < high[0]; ++i) volume.grey[volume.index(i, j, k)] = grey;
}

constexpr double kBall9 = 4.0 / 3 * 3.14159265 * 9 * 9 * 9;

TEST(Segment, TubeAndFluidAreTakenAwayWithoutAThreshold) {
  for (const double fluid : {10.0, 80.0}) {
    const Segmentation s = SegmentOrDie(InTube(fluid, 8));
    EXPECT_GT(s.threshold, fluid + 8) << fluid;
    EXPECT_LT(s.threshold, 150) << fluid;
    EXPECT_NEAR(static_cast<double>(s.voxels), kBall9, 0.08 * kBall9) << fluid;
    EXPECT_GE(s.side_wall_components, 1u);
    EXPECT_FALSE(s.specimen.inside[s.specimen.index(1, 28, 20)]);
    EXPECT_TRUE(s.specimen.inside[s.specimen.index(29, 25, 21)]);
  }
}

TEST(Segment, BridgeToTheTubeIsCutAndTheThinLegStays) {
  Volume volume = InTube(10, 4);
  SetBlock(volume, {36, 24, 20}, {54, 25, 21}, 150);  // touches
  SetBlock(volume, {29, 24, 29}, {30, 25, 36}, 150);  // a leg
  const Segmentation s = SegmentOrDie(volume);
  EXPECT_NEAR(static_cast<double>(s.voxels), kBall9, 0.08 * kBall9);
  EXPECT_TRUE(s.specimen.inside[s.specimen.index(29, 24, 35)]);
  EXPECT_FALSE(s.specimen.inside[s.specimen.index(53, 24, 20)]);
}

TEST(Segment, EachStepCanBeSwitchedOff) {
  Volume volume = InTube(10, 4);
  SetBlock(volume, {27, 23, 19}, {31, 27, 23}, 5);
  SegmentOptions options;
  const Segmentation all = SegmentOrDie(volume, options);
  EXPECT_EQ(all.cavity_voxels, 64u);
  options.fill_cavities = false;
  const Segmentation hollow = SegmentOrDie(volume, options);
  EXPECT_EQ(hollow.cavity_voxels, 0u);
  EXPECT_EQ(hollow.voxels + 64, all.voxels);
  options.drop_side_walls = false;
  options.threshold = 90;
  const Segmentation tube = SegmentOrDie(volume, options);
  EXPECT_TRUE(tube.specimen.inside[tube.specimen.index(1, 28, 20)]);
}

TEST(Segment, LeakingCavityIsFilledUpToTheLeakRadius) {
  Volume volume = InTube(10, 0);
  SetBlock(volume, {25, 21, 17}, {33, 29, 25}, 10);
  SetBlock(volume, {25, 25, 20}, {44, 26, 21}, 10);  // the leak
  SegmentOptions options;
  options.exterior.leak_radius = 0;
  EXPECT_EQ(SegmentOrDie(volume, options).cavity_voxels, 0u);
  options.exterior.leak_radius = 1;
  const Segmentation s = SegmentOrDie(volume, options);
  EXPECT_GE(s.cavity_voxels, 512u);
  EXPECT_LT(s.cavity_voxels, 530u);
}

TEST(Segment, RegionsGrowToTheLowerThreshold) {
  SolidVolume shape;
  const Volume volume = MakeSolidVolume(
      shape,
      [](const Vector3d& p) {
        return std::min(Ball(p, {-4, 0, 0}, 4), Ball(p, {4, 0, 0}, 4));  // they touch
      },
      [](double) { return 100.0; });
  Volume faint = volume;
  for (std::size_t v = 0; v < faint.grey.size(); ++v)
    if (v % 48 >= 24) faint.grey[v] = 10 + 0.5f * (faint.grey[v] - 10);
  SegmentOptions options;
  options.threshold = 70;
  const std::size_t bright = SegmentOrDie(faint, options).voxels;
  options.grow_threshold = 30;
  EXPECT_GT(SegmentOrDie(faint, options).voxels, bright * 9 / 5);
}

TEST(Segment, WhatFillsTheVolumeIsKeptWhole) {
  SolidVolume shape;
  const auto grid = [](const Vector3d& p) {  // bars through all six faces
    const auto bar = [](double a, double b) {
      return std::hypot(std::remainder(a, 6.0), std::remainder(b, 6.0)) - 1.2;
    };
    return std::min({bar(p.x(), p.y()), bar(p.y(), p.z()), bar(p.z(), p.x())});
  };
  const Segmentation s = SegmentOrDie(MakeSolidVolume(shape, grid, [](double) { return 200.0; }));
  EXPECT_EQ(s.side_wall_voxels, 0u);
  EXPECT_EQ(s.notes.size(), 1u);
  EXPECT_GT(s.voxels, s.specimen.inside.size() / 8);
}

TEST(Segment, BadInputs) {
  const auto kind = [](const Result<Segmentation>& s) {
    return s ? ErrorKind::failed : s.error().kind;
  };
  EXPECT_EQ(kind(Segment(Volume{})), ErrorKind::bad_input);
  Volume flat;
  flat.size = {4, 4, 4};
  flat.grey.assign(64, 3.0f);
  EXPECT_EQ(kind(Segment(flat)), ErrorKind::bad_input);
  SegmentOptions unreachable;
  unreachable.threshold = 1e6;
  EXPECT_EQ(kind(Segment(InTube(10, 4), unreachable)), ErrorKind::bad_input);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(kind(Segment(InTube(10, 4), {}, {}, stop.get_token())), ErrorKind::cancelled);
}

TEST(Segment, SameVoxelsForAnyNumberOfThreads) {
  const Volume volume = InTube(80, 8);
  const auto with_threads = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return SegmentOrDie(volume).specimen.inside;
  };
  EXPECT_TRUE(with_threads(1) == with_threads(2));
}

}  // namespace
}  // namespace scan
