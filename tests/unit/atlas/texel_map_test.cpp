#include "reconstruction/atlas/texel_map.h"

#include <gtest/gtest.h>

#include <cmath>

namespace scan {
namespace {

constexpr auto kInside = static_cast<std::uint8_t>(TexelKind::inside);
constexpr auto kGutter = static_cast<std::uint8_t>(TexelKind::gutter);

// A unit square of two faces, cut along the diagonal from (0, 0) to (1, 1) into two charts that lie
// apart in a picture of 32 texels: 10 texels a mm.
AtlasMesh CutSquare() {
  AtlasMesh atlas;
  atlas.mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  atlas.mesh.faces = {{0, 1, 2}, {3, 4, 5}};
  atlas.source_vertex = {0, 1, 2, 0, 2, 3};
  atlas.chart = {0, 1};
  for (const Eigen::Vector2d& texel :
       {Eigen::Vector2d(16, 2), {26, 2}, {26, 12}, {3, 15}, {13, 25}, {3, 25}})
    atlas.uv.push_back(texel / 32);
  return atlas;
}

TEST(TexelMap, InsideTexelsShowTheSurfacePointOfTheirCentre) {
  const AtlasMesh atlas = CutSquare();
  const TexelMap map = MakeTexelMap(atlas, 32, 2);
  int inside = 0;
  for (int row = 0; row < 32; ++row)
    for (int column = 0; column < 32; ++column) {
      if (map.kind.at<std::uint8_t>(row, column) != kInside) continue;
      ++inside;
      const bool first = map.face.at<std::int32_t>(row, column) == 0;
      const Eigen::Vector2d origin = first ? Eigen::Vector2d(16, 2) : Eigen::Vector2d(3, 15);
      const Eigen::Vector2d expected = (Eigen::Vector2d(column + 0.5, row + 0.5) - origin) / 10;
      EXPECT_NEAR((SurfacePoint(atlas, map, column, row).head<2>() - expected).norm(), 0, 1e-6);
    }
  EXPECT_EQ(inside, 55 + 55);  // centres on the diagonal belong to both charts
}

TEST(TexelMap, GutterSurroundsEachChartAndShowsItsNearestPoint) {
  const AtlasMesh atlas = CutSquare();
  for (const int width : {0, 1, 2}) {
    const TexelMap map = MakeTexelMap(atlas, 32, width);
    int gutter = 0;
    for (int row = 0; row < 32; ++row)
      for (int column = 0; column < 32; ++column) {
        const auto kind = map.kind.at<std::uint8_t>(row, column);
        EXPECT_EQ(kind == 0, map.face.at<std::int32_t>(row, column) < 0);
        if (kind != kGutter) continue;
        ++gutter;
        const Eigen::Vector3d p = SurfacePoint(atlas, map, column, row);
        EXPECT_GE(p.minCoeff(), -1e-6);
        EXPECT_LE(p.maxCoeff(), 1 + 1e-6);
      }
    EXPECT_EQ(gutter > 0, width > 0);
    // Left of the first chart's upper left corner lies that corner itself.
    if (width > 0) {
      EXPECT_EQ(map.kind.at<std::uint8_t>(1, 20), kGutter);
      EXPECT_NEAR(SurfacePoint(atlas, map, 20, 1).y(), 0, 1e-6);
      EXPECT_NEAR(SurfacePoint(atlas, map, 20, 1).x(), 0.45, 1e-6);
    }
    EXPECT_EQ(map.kind.at<std::uint8_t>(31, 31), 0);
  }
}

TEST(TexelMap, SeamLinksJoinTexelsThatAreNeighboursOnTheSurface) {
  const AtlasMesh atlas = CutSquare();
  const TexelMap map = MakeTexelMap(atlas, 32, 2);
  EXPECT_GE(map.seam_links.size(), 10u);
  for (const SeamLink& link : map.seam_links) {
    EXPECT_LT(link.a, link.b);
    const Eigen::Vector3d a = SurfacePoint(atlas, map, link.a % 32, link.a / 32);
    const Eigen::Vector3d b = SurfacePoint(atlas, map, link.b % 32, link.b / 32);
    EXPECT_LT((a - b).norm(), 0.2);  // two texels
    EXPECT_NE(map.face.at<std::int32_t>(link.a / 32, link.a % 32),
              map.face.at<std::int32_t>(link.b / 32, link.b % 32));
  }
}

TEST(TexelMap, AnUncutEdgeHasNoLinks) {
  AtlasMesh atlas;
  atlas.mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  atlas.mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  atlas.source_vertex = {0, 1, 2, 3};
  atlas.chart = {0, 0};
  atlas.uv = {{0.1, 0.1}, {0.9, 0.1}, {0.9, 0.9}, {0.1, 0.9}};
  EXPECT_TRUE(MakeTexelMap(atlas, 64, 2).seam_links.empty());
}

TEST(TexelMap, AFaceSmallerThanATexelStillHoldsOne) {
  AtlasMesh atlas;
  atlas.mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  atlas.mesh.faces = {{0, 1, 2}};
  atlas.source_vertex = {0, 1, 2};
  atlas.chart = {0};
  atlas.uv = {{0.501, 0.501}, {0.502, 0.501}, {0.501, 0.502}};
  const TexelMap map = MakeTexelMap(atlas, 16, 1);
  EXPECT_EQ(map.kind.at<std::uint8_t>(8, 8), kInside);
  EXPECT_EQ(map.face.at<std::int32_t>(8, 8), 0);
  EXPECT_EQ(cv::countNonZero(map.kind), 9);
}

TEST(TexelMap, DegenerateFacesAreNoError) {
  AtlasMesh atlas;
  atlas.mesh.vertices = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  atlas.mesh.faces = {{0, 1, 2}};
  atlas.source_vertex = {0, 0, 0};
  atlas.chart = {0};
  atlas.uv = {{1, 1}, {1, 1}, {1, 1}};
  const TexelMap map = MakeTexelMap(atlas, 8, 0);
  EXPECT_EQ(map.kind.at<std::uint8_t>(7, 7), kInside);
  EXPECT_TRUE(SurfacePoint(atlas, map, 7, 7).isZero());
}

}  // namespace
}  // namespace scan
