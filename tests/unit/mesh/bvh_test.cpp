#include "reconstruction/mesh/bvh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "drivers/base/rng.h"
#include "tests/support/meshes.h"

namespace scan {
namespace {

TEST(MeshBvh, ClosestPointOfABox) {
  const MeshBvh bvh(meshes::Box({0, 0, 0}, {1, 1, 1}));
  const auto above = bvh.Closest({0.25, 0.5, 3});
  ASSERT_TRUE(above);
  EXPECT_NEAR((above->point - Eigen::Vector3d(0.25, 0.5, 1)).norm(), 0, 1e-12);
  EXPECT_NEAR(above->distance_mm, 2, 1e-12);
  EXPECT_NEAR(bvh.Closest({0.4, 0.5, 0.5})->distance_mm, 0.4, 1e-12);
  EXPECT_NEAR(bvh.Closest({2, 2, 2})->distance_mm, std::sqrt(3.0), 1e-12);
}

// Against the distance to a sphere, which its fine mesh keeps to.
TEST(MeshBvh, ClosestPointOfASphere) {
  const MeshBvh bvh(meshes::Icosphere(10, 4));
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d p(rng.Uniform(-15, 15), rng.Uniform(-15, 15), rng.Uniform(-15, 15));
    const auto closest = bvh.Closest(p);
    EXPECT_NEAR(closest->distance_mm, std::abs(p.norm() - 10), 0.03);
    EXPECT_NEAR(closest->point.norm(), 10, 0.03);
  }
}

TEST(MeshBvh, RaysHitTheFirstFaceFromEitherSide) {
  const TriangleMesh box = meshes::Box({0, 0, 0}, {1, 1, 1});
  const MeshBvh bvh(box);
  const auto hit = bvh.FirstHit({0.3, 0.4, 5}, {0, 0, -7});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance_mm, 4, 1e-12);
  for (const std::uint32_t v : box.faces[hit->face]) EXPECT_EQ(box.vertices[v].z(), 1);
  EXPECT_NEAR(bvh.FirstHit({0.3, 0.4, 0.5}, {0, 0, -1})->distance_mm, 0.5, 1e-12);
  EXPECT_FALSE(bvh.FirstHit({0.3, 0.4, 5}, {0, 0, 1}));
  EXPECT_FALSE(bvh.FirstHit({5, 5, 5}, {1, 0, 0}));
}

TEST(MeshBvh, MeshesWithoutAreaGiveNothing) {
  TriangleMesh line;
  line.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  line.faces = {{0, 1, 2}};
  for (const TriangleMesh& mesh : {TriangleMesh{}, line}) {
    const MeshBvh bvh(mesh);
    EXPECT_FALSE(bvh.Closest({0, 0, 0}));
    EXPECT_FALSE(bvh.FirstHit({0, 0, 1}, {0, 0, -1}));
  }
}

}  // namespace
}  // namespace scan
