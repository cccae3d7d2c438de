#include "reconstruction/mesh/mesh.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/meshes.h"

namespace scan {
namespace {

TEST(Mesh, BoxHasItsAreaVolumeAndCentre) {
  const TriangleMesh box = meshes::Box({1, 2, 3}, {2, 4, 6});
  EXPECT_NEAR(SurfaceArea(box), 2 * (2 + 3 + 6), 1e-12);
  EXPECT_NEAR(SignedVolume(box), 6, 1e-12);
  EXPECT_NEAR((MassCentre(box) - Eigen::Vector3d(1.5, 3, 4.5)).norm(), 0, 1e-12);
  EXPECT_TRUE(BoundsOf(box).low.isApprox(Eigen::Vector3d(1, 2, 3)));
  EXPECT_TRUE(BoundsOf(box).high.isApprox(Eigen::Vector3d(2, 4, 6)));
}

TEST(Mesh, VolumeIsExactFarFromTheOrigin) {
  const Eigen::Vector3d far(1e6, -1e6, 1e6);
  EXPECT_NEAR(SignedVolume(meshes::Box(far, far + Eigen::Vector3d(1, 1, 1))), 1, 1e-9);
}

TEST(Mesh, TurnedInsideOutTheVolumeChangesSignAndTheCentreStays) {
  TriangleMesh box = meshes::Box({0, 0, 0}, {1, 1, 1});
  for (Face& face : box.faces) std::swap(face[0], face[1]);
  EXPECT_NEAR(SignedVolume(box), -1, 1e-12);
  EXPECT_NEAR((MassCentre(box) - Eigen::Vector3d(0.5, 0.5, 0.5)).norm(), 0, 1e-12);
}

TEST(Mesh, MassCentreOfAnOpenMeshIsThatOfItsSurface) {
  TriangleMesh box = meshes::Box({0, 0, 0}, {1, 1, 1});
  box.faces.resize(2);  // the side z = 0
  EXPECT_NEAR((MassCentre(box) - Eigen::Vector3d(0.5, 0.5, 0)).norm(), 0, 1e-12);
}

TEST(Mesh, MassCentreOfASolidIsNotThatOfItsSurface) {
  // A cone's solid centre lies at a quarter of its height, its surface's higher or lower.
  TriangleMesh cone;
  const int n = 200;
  for (int i = 0; i < n; ++i)
    cone.vertices.emplace_back(std::cos(2 * kPi * i / n), std::sin(2 * kPi * i / n), 0);
  cone.vertices.emplace_back(0, 0, 0);
  cone.vertices.emplace_back(0, 0, 4);
  for (std::uint32_t i = 0; i < n; ++i) {
    cone.faces.push_back({i, (i + 1) % n, n + 1});
    cone.faces.push_back({(i + 1) % n, i, n});
  }
  EXPECT_NEAR(MassCentre(cone).z(), 1.0, 1e-6);
}

TEST(Mesh, NormalsPointOutwards) {
  const TriangleMesh sphere = meshes::Icosphere(3, 3, {1, 2, 3});
  const auto normals = VertexNormals(sphere);
  for (std::size_t v = 0; v < normals.size(); ++v)
    EXPECT_GT(normals[v].dot((sphere.vertices[v] - Eigen::Vector3d(1, 2, 3)).normalized()), 0.999);
  for (const auto& n : FaceNormals(sphere)) EXPECT_NEAR(n.norm(), 1, 1e-12);
}

TEST(Mesh, DegenerateFacesAndLonelyVerticesHaveZeroNormals) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {9, 9, 9}};
  mesh.faces = {{0, 1, 2}};
  EXPECT_TRUE(FaceNormals(mesh)[0].isZero());
  for (const auto& n : VertexNormals(mesh)) EXPECT_TRUE(n.isZero());
}

TEST(Topology, ClosedSurfaces) {
  const auto sphere = CheckTopology(meshes::Icosphere(1, 2));
  EXPECT_TRUE(sphere.closed_manifold());
  EXPECT_EQ(sphere.euler, 2);
  EXPECT_EQ(sphere.components, 1u);
  const auto torus = CheckTopology(meshes::Torus(3, 1, 20, 10));
  EXPECT_TRUE(torus.closed_manifold());
  EXPECT_EQ(torus.euler, 0);
  const auto two = CheckTopology(
      meshes::Joined(meshes::Cylinder(1, 2, 12, 3), meshes::Box({5, 5, 5}, {6, 6, 6})));
  EXPECT_TRUE(two.closed_manifold());
  EXPECT_EQ(two.components, 2u);
  EXPECT_EQ(two.euler, 4);
  const auto gyroid = CheckTopology(meshes::Gyroid(10, 8, 24));
  EXPECT_TRUE(gyroid.closed_manifold());
  EXPECT_LT(gyroid.euler, 0);
}

TEST(Topology, EveryBuilderIsOutward) {
  for (const auto& mesh : {meshes::Icosphere(1, 1), meshes::Torus(3, 1, 20, 10),
                           meshes::Cylinder(1, 2, 12, 3), meshes::Gyroid(10, 8, 16)})
    EXPECT_GT(SignedVolume(mesh), 0);
}

TEST(Topology, NamesEachFault) {
  TriangleMesh open = meshes::Box({0, 0, 0}, {1, 1, 1});
  open.faces.pop_back();
  EXPECT_EQ(CheckTopology(open).boundary_edges, 3u);

  TriangleMesh flipped = meshes::Box({0, 0, 0}, {1, 1, 1});
  std::swap(flipped.faces[0][0], flipped.faces[0][1]);
  EXPECT_EQ(CheckTopology(flipped).inconsistent_edges, 3u);
  EXPECT_EQ(CheckTopology(flipped).boundary_edges, 0u);

  TriangleMesh fin;  // three faces at one edge
  fin.vertices = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}};
  fin.faces = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}};
  EXPECT_EQ(CheckTopology(fin).non_manifold_edges, 1u);

  TriangleMesh bow_tie;  // two faces that meet in one point
  bow_tie.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}};
  bow_tie.faces = {{0, 1, 2}, {0, 3, 4}};
  EXPECT_EQ(CheckTopology(bow_tie).non_manifold_vertices, 1u);
  EXPECT_EQ(CheckTopology(bow_tie).components, 1u);
}

TEST(Topology, NeighboursAreMutualAndShareTheirEdge) {
  const TriangleMesh mesh = meshes::Torus(3, 1, 9, 7);
  const auto neighbours = FaceNeighbours(mesh);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_GE(neighbours[f][k], 0);
      const auto g = static_cast<std::size_t>(neighbours[f][k]);
      EXPECT_TRUE(std::count(neighbours[g].begin(), neighbours[g].end(), static_cast<int>(f)));
      for (const std::size_t corner : {k, (k + 1) % 3})
        EXPECT_TRUE(std::count(mesh.faces[g].begin(), mesh.faces[g].end(), mesh.faces[f][corner]));
    }
}

TEST(Topology, NoNeighbourAcrossBoundaryOrNonManifoldEdges) {
  TriangleMesh fin;
  fin.vertices = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}};
  fin.faces = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {0, 0, 1}};
  for (const auto& row : FaceNeighbours(fin))
    for (const int neighbour : row) EXPECT_EQ(neighbour, -1);
}

TEST(Topology, AnEmptyMeshIsNoError) {
  const TriangleMesh none;
  EXPECT_EQ(CheckTopology(none).components, 0u);
  EXPECT_EQ(SurfaceArea(none), 0);
  EXPECT_EQ(SignedVolume(none), 0);
  EXPECT_TRUE(FaceNeighbours(none).empty());
}

}  // namespace
}  // namespace scan
