#include "reconstruction/volume/voxel_set.h"

#include <gtest/gtest.h>

#include "drivers/base/rng.h"

namespace scan {
namespace {

VoxelSet Random(std::array<std::size_t, 3> size, double share, std::uint64_t seed) {
  VoxelSet set{size, {}};
  Rng rng(seed);
  for (std::size_t v = 0; v < size[0] * size[1] * size[2]; ++v)
    set.inside.push_back(rng.Uniform() < share);
  return set;
}

// Calls visit(index) for the voxels of the cube of `radius` about (i, j, k) within the set.
template <class Visit>
void ForCube(const VoxelSet& set, std::size_t i, std::size_t j, std::size_t k, int radius,
             Visit visit) {
  for (int c = -radius; c <= radius; ++c)
    for (int b = -radius; b <= radius; ++b)
      for (int a = -radius; a <= radius; ++a) {
        const std::size_t x = i + a, y = j + b, z = k + c;  // wraps below 0
        if (x < set.size[0] && y < set.size[1] && z < set.size[2]) visit(set.index(x, y, z));
      }
}

TEST(VoxelSet, DilationAndErosionAreTheCubeOnes) {
  for (const int radius : {1, 2, 5}) {
    const VoxelSet set = Random({19, 6, 7}, radius == 5 ? 0.005 : 0.05, 7);
    VoxelSet complement = set;
    for (auto& v : complement.inside) v = !v;
    const VoxelSet dilated = Dilated(set, radius), eroded = Eroded(complement, radius);
    for (std::size_t k = 0; k < 7; ++k)
      for (std::size_t j = 0; j < 6; ++j)
        for (std::size_t i = 0; i < 19; ++i) {
          bool any = false;
          ForCube(set, i, j, k, radius, [&](std::size_t v) { any |= set.inside[v] != 0; });
          ASSERT_EQ(dilated.inside[set.index(i, j, k)] != 0, any);
          ASSERT_EQ(eroded.inside[set.index(i, j, k)] != 0, !any);
        }
  }
}

TEST(VoxelSet, ComponentsAgreeWithAFloodFill) {
  for (const Connectivity connectivity : {Connectivity::faces, Connectivity::corners}) {
    const VoxelSet set = Random({13, 11, 9}, connectivity == Connectivity::faces ? 0.3 : 0.1, 3);
    const Labelling labelling = LabelComponents(set, connectivity);
    std::vector<std::uint32_t> expected(set.inside.size(), 0);
    std::uint32_t count = 0;
    for (std::size_t seed = 0; seed < set.inside.size(); ++seed) {
      if (!set.inside[seed] || expected[seed]) continue;
      std::vector<std::size_t> open{seed};
      expected[seed] = ++count;
      while (!open.empty()) {
        const std::size_t v = open.back();
        open.pop_back();
        const std::size_t i = v % 13, j = v / 13 % 11, k = v / 143;
        ForCube(set, i, j, k, 1, [&](std::size_t n) {
          const int apart = (n % 13 != i) + (n / 13 % 11 != j) + (n / 143 != k);
          if (!set.inside[n] || expected[n]) return;
          if (connectivity == Connectivity::faces && apart > 1) return;
          expected[n] = count;
          open.push_back(n);
        });
      }
    }
    EXPECT_EQ(labelling.components.size(), count);
    EXPECT_EQ(labelling.label, expected);  // both number by first voxel
    std::size_t voxels = 0;
    for (const Component& c : labelling.components) voxels += c.voxels;
    EXPECT_EQ(voxels, Count(set));
  }
}

TEST(VoxelSet, WallsAreTold) {
  VoxelSet set{{5, 5, 5}, std::vector<std::uint8_t>(125, 0)};
  set.inside[set.index(2, 2, 0)] = 1;  // first slice: a wall, not a side wall
  set.inside[set.index(4, 2, 2)] = 1;  // side
  set.inside[set.index(2, 2, 2)] = 1;  // neither
  const Labelling l = LabelComponents(set, Connectivity::corners);
  ASSERT_EQ(l.components.size(), 3u);
  EXPECT_TRUE(l.components[0].any_wall && !l.components[0].side_wall);
  EXPECT_TRUE(!l.components[1].any_wall && !l.components[1].side_wall);
  EXPECT_TRUE(l.components[2].any_wall && l.components[2].side_wall);
}

TEST(VoxelSet, ComponentsByFacesEdgesAndCorners) {
  VoxelSet set{{5, 5, 5}, std::vector<std::uint8_t>(125, 0)};
  set.inside[set.index(0, 0, 0)] = 1;
  set.inside[set.index(1, 0, 0)] = 1;  // a face
  set.inside[set.index(2, 1, 0)] = 1;  // an edge within the slice
  set.inside[set.index(2, 2, 1)] = 1;  // edges across slices
  set.inside[set.index(3, 2, 2)] = 1;
  set.inside[set.index(4, 3, 3)] = 1;  // a corner
  EXPECT_EQ(LabelComponents(set, Connectivity::faces).components.size(), 5u);
  const Labelling edges = LabelComponents(set, Connectivity::edges);
  ASSERT_EQ(edges.components.size(), 2u);
  EXPECT_EQ(LargestOf(edges), 0);
  EXPECT_EQ(LabelComponents(set, Connectivity::corners).components.size(), 1u);
  EXPECT_EQ(LargestOf(Labelling{}), -1);
}

TEST(VoxelSet, CavitiesAreClosedForFaceNeighbours) {
  VoxelSet shell{{7, 7, 7}, std::vector<std::uint8_t>(343, 0)};
  for (std::size_t k = 1; k < 6; ++k)
    for (std::size_t j = 1; j < 6; ++j)
      for (std::size_t i = 1; i < 6; ++i)
        shell.inside[shell.index(i, j, k)] =
            i == 1 || i == 5 || j == 1 || j == 5 || k == 1 || k == 5;
  EXPECT_EQ(Count(EnclosedCavities(shell)), 27u);
  shell.inside[shell.index(1, 1, 3)] = 0;  // an edge of the box: no face path leads in
  EXPECT_EQ(Count(EnclosedCavities(shell)), 27u);
  shell.inside[shell.index(1, 3, 3)] = 0;
  EXPECT_EQ(Count(EnclosedCavities(shell)), 0u);
}

}  // namespace
}  // namespace scan
