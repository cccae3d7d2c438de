#include "reconstruction/render/contour_generators.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "drivers/base/units.h"

#include "tests/support/meshes.h"

namespace scan {
namespace {

constexpr double kDistance_mm = 300, kRadius_mm = 15, kFocal_px = 6000;

Intrinsics Camera() {
  Intrinsics in;
  in.w = 800;
  in.h = 700;
  in.fl_x = in.fl_y = kFocal_px;
  in.cx = 400;
  in.cy = 350;
  return in;
}

CameraFromModel Ahead(double distance_mm) {
  return {Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 0, distance_mm)};
}

std::vector<ContourSegment> Contours(const TriangleMesh& mesh, double distance_mm = kDistance_mm) {
  const Raster raster = Rasterise(mesh, Ahead(distance_mm), Camera());
  return ContourGenerators(mesh, BuildMeshEdges(mesh), Ahead(distance_mm), Camera(), raster);
}

void Append(TriangleMesh& mesh, const TriangleMesh& other) {
  const auto shift = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const Face& f : other.faces) {
    mesh.faces.push_back({f[0] + shift, f[1] + shift, f[2] + shift});
  }
}

TEST(ContourGenerators, OfASphereLieOnTheAnalyticCircle) {
  const TriangleMesh mesh = meshes::Icosphere(kRadius_mm, 5);
  const auto segments = Contours(mesh);
  const double radius_px =
      kFocal_px * kRadius_mm / std::sqrt(kDistance_mm * kDistance_mm - kRadius_mm * kRadius_mm);
  double length_px = 0;
  for (const ContourSegment& s : segments) {
    EXPECT_TRUE(s.visible);
    EXPECT_TRUE(s.outer);
    EXPECT_GE(s.faces[0], 0);
    EXPECT_GE(s.faces[1], 0);
    std::array<Eigen::Vector2d, 2> ends;
    for (std::size_t k = 0; k < 2; ++k) {
      ends[k] = *Project(Camera(), Ahead(kDistance_mm) * mesh.vertices[s.vertices[k]]) -
                Eigen::Vector2d(400, 350);
      // Edges are about 0.6 mm long, 0.02 rad of the silhouette: (0.02)^2 / 2 of the radius.
      EXPECT_NEAR(ends[k].norm(), radius_px, radius_px * 1e-3);
    }
    length_px += (ends[1] - ends[0]).norm();
  }
  EXPECT_GE(length_px, 2 * kPi * radius_px * 0.99);
}

TEST(ContourGenerators, FormClosedLoopsOnAClosedMesh) {
  std::map<std::uint32_t, int> degree;
  for (const ContourSegment& s : Contours(meshes::Icosphere(kRadius_mm, 4))) {
    for (std::uint32_t v : s.vertices) ++degree[v];
  }
  ASSERT_GT(degree.size(), 20u);
  for (const auto& [vertex, count] : degree) EXPECT_EQ(count % 2, 0) << vertex;
}

TEST(ContourGenerators, DoNotDependOnFaceOrientation) {
  const TriangleMesh mesh = meshes::Icosphere(kRadius_mm, 4);
  TriangleMesh mixed = mesh;
  for (std::size_t f = 0; f < mixed.faces.size(); f += 3) {
    std::swap(mixed.faces[f][0], mixed.faces[f][1]);
  }
  TriangleMesh inward = mesh;
  for (Face& f : inward.faces) std::swap(f[0], f[1]);
  EXPECT_EQ(BuildMeshEdges(mesh).outward, 1);
  EXPECT_EQ(BuildMeshEdges(inward).outward, -1);
  EXPECT_EQ(BuildMeshEdges(mixed).outward, 0);
  const auto expected = Contours(mesh);
  for (const auto& other : {Contours(mixed), Contours(inward)}) {
    ASSERT_EQ(other.size(), expected.size());
    for (std::size_t k = 0; k < expected.size(); ++k) {
      EXPECT_EQ(other[k].vertices, expected[k].vertices);
      EXPECT_EQ(other[k].visible, expected[k].visible);
      EXPECT_EQ(other[k].outer, expected[k].outer);
    }
  }
}

TEST(ContourGenerators, KnowWhatIsHiddenAndWhatIsInner) {
  // A small sphere before a large one before another small one, all on the optical axis.
  TriangleMesh mesh = meshes::Icosphere(3, 4, {0, 0, -40});
  const auto front_end = static_cast<std::uint32_t>(mesh.vertices.size());
  Append(mesh, meshes::Icosphere(kRadius_mm, 5));
  const auto middle_end = static_cast<std::uint32_t>(mesh.vertices.size());
  Append(mesh, meshes::Icosphere(3, 4, {0, 0, 40}));
  int front = 0, middle = 0, back = 0;
  for (const ContourSegment& s : Contours(mesh)) {
    if (s.vertices[0] < front_end) {
      ++front;
      EXPECT_TRUE(s.visible);
      EXPECT_FALSE(s.outer);
    } else if (s.vertices[0] < middle_end) {
      ++middle;
      EXPECT_TRUE(s.visible);
      EXPECT_TRUE(s.outer);
    } else {
      ++back;
      EXPECT_FALSE(s.visible);
      EXPECT_FALSE(s.outer);
    }
  }
  EXPECT_GT(front, 30);
  EXPECT_GT(middle, 60);
  EXPECT_GT(back, 30);
}

TEST(ContourGenerators, HollowFoldsAreHidden) {
  // Seen along +z, the notch at the middle of this W-shaped prism folds away from the camera.
  TriangleMesh mesh;
  const std::vector<Eigen::Vector2d> outline{{-10, -10}, {10, -10}, {10, 10}, {0, 2}, {-10, 10}};
  for (double y : {-5.0, 5.0}) {
    for (const auto& p : outline) mesh.vertices.push_back({p.y(), y, p.x()});
  }
  for (std::uint32_t k = 0; k < 5; ++k) {
    const std::uint32_t n = (k + 1) % 5;
    mesh.faces.push_back({k, k + 5, n + 5});
    mesh.faces.push_back({k, n + 5, n});
  }
  for (const Face& f : std::vector<Face>{{0, 1, 3}, {1, 2, 3}, {0, 3, 4}}) {
    mesh.faces.push_back(f);
    mesh.faces.push_back({f[0] + 5, f[2] + 5, f[1] + 5});
  }
  const MeshEdges edges = BuildMeshEdges(mesh);
  ASSERT_NE(edges.outward, 0);
  int hollow = 0;
  for (const ContourSegment& s : Contours(mesh, 200)) {
    if (s.vertices == std::array<std::uint32_t, 2>{3, 8}) {
      ++hollow;
      EXPECT_FALSE(s.visible);
    }
  }
  EXPECT_EQ(hollow, 1);
}

TEST(ContourGenerators, IncludeTheBoundaryOfAnOpenMesh) {
  TriangleMesh mesh;
  mesh.vertices = {{-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}};
  mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  const auto segments = Contours(mesh);
  ASSERT_EQ(segments.size(), 4u);  // not the diagonal
  for (const ContourSegment& s : segments) {
    EXPECT_EQ(s.faces[1], -1);
    EXPECT_TRUE(s.visible);
    EXPECT_TRUE(s.outer);
  }
}

TEST(ContourGenerators, OutsideOfThePictureAreNotVisible) {
  const TriangleMesh mesh = meshes::Icosphere(kRadius_mm, 4, {200, 0, 0});
  const auto segments = Contours(mesh);
  ASSERT_GT(segments.size(), 20u);
  for (const ContourSegment& s : segments) EXPECT_FALSE(s.visible);
}

}  // namespace
}  // namespace scan
