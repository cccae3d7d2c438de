#include "reconstruction/surface/clean.h"

#include <gtest/gtest.h>

namespace scan {
namespace {

// A tetrahedron on the corners a, b, c, d of `mesh`, outward when d lies on the side that a, b, c
// turn clockwise about.
void AddTetrahedron(TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c,
                    std::uint32_t d) {
  for (const Face& f : {Face{a, b, c}, Face{a, d, b}, Face{b, d, c}, Face{c, d, a}})
    mesh.faces.push_back(f);
}

TEST(MakeManifold, SplitsAVertexOfTwoFans) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0},  {1, 0, 1},  {0, 1, 1},   {-1, -1, 1},
                   {1, 0, -1}, {0, 1, -1}, {-1, -1, -1}};
  AddTetrahedron(mesh, 1, 2, 3, 0);
  AddTetrahedron(mesh, 6, 5, 4, 0);
  ASSERT_EQ(CheckTopology(mesh).non_manifold_vertices, 1u);
  const CleanReport report = MakeManifold(mesh);
  EXPECT_EQ(report.split_vertices, 1u);
  EXPECT_TRUE(CheckTopology(mesh).closed_manifold());
  EXPECT_EQ(CheckTopology(mesh).components, 2u);
}

TEST(MakeManifold, SplitsAnEdgeOfFourFacesIntoItsSolids) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {0, 0, 1}, {1, 0.2, 0}, {1, -0.2, 0}, {-1, 0.2, 0}, {-1, -0.2, 0}};
  AddTetrahedron(mesh, 0, 1, 2, 3);
  AddTetrahedron(mesh, 0, 1, 5, 4);
  ASSERT_EQ(CheckTopology(mesh).non_manifold_edges, 1u);
  ASSERT_NEAR(std::abs(SignedVolume(mesh)), 2 * 0.4 / 6, 1e-12);
  MakeManifold(mesh);
  EXPECT_TRUE(CheckTopology(mesh).closed_manifold());
  EXPECT_EQ(CheckTopology(mesh).components, 2u);
  EXPECT_EQ(mesh.vertices.size(), 8u);
}

TEST(MakeManifold, RemovesSheetsAndDegenerateFaces) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}, {2, 2, 2}};
  AddTetrahedron(mesh, 0, 1, 2, 3);
  mesh.faces.push_back({0, 1, 4});
  mesh.faces.push_back({1, 0, 4});
  mesh.faces.push_back({2, 2, 3});
  const CleanReport report = MakeManifold(mesh);
  EXPECT_EQ(report.cancelled_faces, 2u);
  EXPECT_EQ(report.degenerate_faces, 1u);
  EXPECT_TRUE(CheckTopology(mesh).closed_manifold());
  EXPECT_EQ(mesh.vertices.size(), 4u);
}

TEST(MakeManifold, SeparatesTwoSheetsThatShareAnEdgeOfOneFan) {
  // Two tetrahedra share an edge, and their other corners are joined by a third and fourth, so that
  // both ends of the crowded edge may lie in one fan: only a new vertex on it separates the pairs.
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {0, 0, 1}, {1, 0.2, 0}, {1, -0.2, 0}, {-1, 0.2, 0}, {-1, -0.2, 0}};
  AddTetrahedron(mesh, 0, 1, 2, 3);
  AddTetrahedron(mesh, 0, 1, 5, 4);
  AddTetrahedron(mesh, 0, 1, 4, 2);
  MakeManifold(mesh);
  EXPECT_TRUE(CheckTopology(mesh).closed_manifold());
}

TEST(DropSmallComponents, KeepsTheLargeOnesAndDropsInwardOnes) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1},
                   {5, 0, 0}, {6, 0, 0}, {5, 1, 0}, {5, 0, -1}};
  AddTetrahedron(mesh, 0, 1, 2, 3);
  AddTetrahedron(mesh, 4, 6, 5, 7);
  ASSERT_GT(SignedVolume(TriangleMesh{mesh.vertices, {mesh.faces.begin(), mesh.faces.begin() + 4}}),
            0);
  EXPECT_EQ(DropSmallComponents(mesh, 0.0, false), 0u);
  EXPECT_EQ(DropSmallComponents(mesh, 0.0, true), 1u);
  EXPECT_EQ(mesh.faces.size(), 4u);
  EXPECT_GT(SignedVolume(mesh), 0);
}

}  // namespace
}  // namespace scan
