#include "reconstruction/volume/exterior.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <functional>

#include "drivers/base/rng.h"

namespace scan {
namespace {

using InSolid = std::function<bool(int, int, int)>;

VoxelSet Make(std::size_t n, const InSolid& in) {
  VoxelSet set{{n, n, n}, std::vector<std::uint8_t>(n * n * n, 0)};
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t j = 0; j < n; ++j)
      for (std::size_t i = 0; i < n; ++i)
        set.inside[set.index(i, j, k)] =
            in(static_cast<int>(i), static_cast<int>(j), static_cast<int>(k));
  return set;
}

bool At(const VoxelSet& set, std::size_t i, std::size_t j, std::size_t k) {
  return set.inside[set.index(i, j, k)] != 0;
}

bool InShell(int i, int j, int k) {
  const double r = std::hypot(i - 15, j - 15, k - 15);
  return r <= 12 && r > 9;
}

TEST(InnerSpaces, ChamberBehindPoresIsFilledAndThePoresBecomeDimples) {
  const VoxelSet shell = Make(31, [](int i, int j, int k) {
    const bool pore = (j == 15 && k == 15) || (i == 15 && k == 15) || (i == 15 && (j == k));
    return InShell(i, j, k) && !pore;
  });
  const VoxelSet inner = InnerSpaces(shell);
  EXPECT_TRUE(At(inner, 15, 15, 15));
  EXPECT_TRUE(At(inner, 6, 15, 15));   // up to the wall
  EXPECT_FALSE(At(inner, 3, 15, 15));  // the mouth of the pore
  std::size_t within = 0, filled = 0;
  for (std::size_t k = 0; k < 31; ++k)
    for (std::size_t j = 0; j < 31; ++j)
      for (std::size_t i = 0; i < 31; ++i) {
        if (std::hypot(i - 15.0, j - 15.0, k - 15.0) > 9) continue;
        ++within;
        filled += At(inner, i, j, k);
      }
  EXPECT_EQ(filled, within);
}

TEST(InnerSpaces, AWideOpeningIsNoLeak) {
  const VoxelSet bowl = Make(
      31, [](int i, int j, int k) { return InShell(i, j, k) && std::hypot(j - 15, k - 15) > 4; });
  EXPECT_EQ(Count(InnerSpaces(bowl)), 0u);
  EXPECT_GT(Count(InnerSpaces(bowl, {.leak_radius = 5})), 1000u);
}

TEST(InnerSpaces, GapBetweenTwoPartsStaysOpenToItsDepth) {
  // Two plates on a common foot, two voxels apart: a leg along a body.
  const VoxelSet plates = Make(24, [](int i, int j, int k) {
    const bool slab = j >= 4 && j < 20 && k >= 4 && k < 20;
    return slab && ((i >= 6 && i < 10) || (i >= 12 && i < 16) || (k < 6 && i >= 6 && i < 16));
  });
  EXPECT_EQ(Count(InnerSpaces(plates)), 0u);
  const VoxelSet shallow = InnerSpaces(plates, {.leak_radius = 2, .depth = 3});
  EXPECT_GT(Count(shallow), 0u);
  EXPECT_FALSE(At(shallow, 10, 12, 18));  // at the mouth
  EXPECT_TRUE(At(shallow, 10, 12, 8));    // deep within
}

TEST(InnerSpaces, NarrowTunnelIsClosedByAThinWallAndAWideOneStays) {
  const auto block = [](int i, int j, int k) {
    return i >= 4 && i < 20 && j >= 4 && j < 20 && k >= 8 && k < 16;
  };
  const VoxelSet narrow =
      Make(24, [&](int i, int j, int k) { return block(i, j, k) && !(i == 12 && j == 12); });
  EXPECT_EQ(Count(InnerSpaces(narrow)), 1u);
  const VoxelSet wide = Make(24, [&](int i, int j, int k) {
    return block(i, j, k) && !(std::abs(i - 12) <= 3 && std::abs(j - 12) <= 3);
  });
  EXPECT_EQ(Count(InnerSpaces(wide)), 0u);
}

TEST(InnerSpaces, SolidAtTheBorderAndEmptySets) {
  const VoxelSet full = Make(9, [](int i, int j, int k) { return i != 4 || j != 4 || k != 4; });
  EXPECT_EQ(Count(InnerSpaces(full)), 1u);
  const VoxelSet none = Make(9, [](int, int, int) { return false; });
  EXPECT_EQ(Count(InnerSpaces(none)), 0u);
  // A well that opens at the border of the volume is open.
  const VoxelSet well = Make(9, [](int i, int j, int) { return i != 4 || j != 4; });
  EXPECT_EQ(Count(InnerSpaces(well, {.leak_radius = 0})), 0u);
  const VoxelSet closed_within =
      Make(9, [](int i, int j, int k) { return i != 4 || j != 4 || k == 0 || k == 8; });
  EXPECT_EQ(Count(InnerSpaces(closed_within, {.leak_radius = 0})), 7u);
}

TEST(InnerSpaces, NeverTouchesTheSolidAndGivesTheSameForAnyNumberOfThreads) {
  Rng rng(3);
  const VoxelSet noise = Make(40, [&](int i, int j, int k) {
    return std::hypot(i - 20, j - 20, k - 20) < 15 && rng.Uniform() < 0.6;
  });
  const auto with_threads = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return InnerSpaces(noise);
  };
  const VoxelSet one = with_threads(1);
  EXPECT_TRUE(one.inside == with_threads(2).inside);
  EXPECT_GT(Count(one), 1000u);
  for (std::size_t v = 0; v < one.inside.size(); ++v)
    ASSERT_FALSE(one.inside[v] && noise.inside[v]);
}

}  // namespace
}  // namespace scan
