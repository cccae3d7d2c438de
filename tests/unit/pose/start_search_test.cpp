#include "reconstruction/pose/start_search.h"

#include <gtest/gtest.h>

#include "drivers/base/rng.h"
#include "pose_scene.h"
#include "reconstruction/pose/choose_start.h"
#include "reconstruction/pose/score.h"
#include "reconstruction/pose/solve_joint.h"

namespace scan {
namespace {

TEST(IcosphereDirections, FourSubdivisionsAreThePapersCount) {
  const auto directions = IcosphereDirections(4);
  EXPECT_EQ(directions.size(), 2562u);
  for (const auto& d : directions) EXPECT_NEAR(d.norm(), 1, 1e-12);
}

TEST(ClusteredMesh, KeepsTheShapeWithFewerFaces) {
  const TriangleMesh mesh = test::BugMesh(4);
  const TriangleMesh few = ClusteredMesh(mesh, 1.0);
  EXPECT_LT(few.faces.size(), mesh.faces.size() / 3);
  EXPECT_LT((BoundsOf(mesh).low - BoundsOf(few).low).norm(), 1.0);
  EXPECT_LT((BoundsOf(mesh).high - BoundsOf(few).high).norm(), 1.0);
}

// A coarser search than the default, for quick tests.
StartOptions Coarse() {
  StartOptions options;
  options.subdivisions = 3;
  options.angles = 48;
  return options;
}

JointOptions CoarseSearch() {
  JointOptions options;
  options.start = Coarse();
  return options;
}

// Placings are drawn at random: standing, lying, upside down.
TEST(SearchStarts, FindsAnyPlacing) {
  const TriangleMesh mesh = test::BugMesh(2);
  const ContourMesh contour_mesh(mesh);
  Rng rng(3);
  for (int trial = 0; trial < 3; ++trial) {
    const Eigen::Vector3d turn(rng.Normal(), rng.Normal(), rng.Normal());
    const TableFromModel placing(ExpSo3(2 * turn), Eigen::Vector3d(3, -2, 12));
    test::SceneOptions options;
    options.w = 462;
    options.h = 306;
    options.views = 6;
    const test::Scene scene = test::MakeScene(mesh, placing, options);
    const RigModel rig(scene.photos, {});
    std::vector<PhotoContour> photos;
    for (const Mask& mask : scene.masks) photos.push_back(MakePhotoContour(mask));
    const auto found = SearchStarts(contour_mesh, rig, photos,
                                    std::vector<bool>(photos.size(), true), Coarse(), {});
    ASSERT_GE(found.size(), 8u);
    const TableFromModel& best = found.front().table_from_model;
    EXPECT_LT(DegFromRad(AngleBetween(best.rotation(), placing.rotation())), 9) << trial;
    EXPECT_LT((best * contour_mesh.centre - placing * contour_mesh.centre).norm(), 2) << trial;
    for (std::size_t i = 0; i < found.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        EXPECT_GE(AngleBetween(found[i].table_from_model.rotation(),
                               found[j].table_from_model.rotation()),
                  0.3);
  }
}

TEST(SolveJoint, UnknownPlacingAndStaticRigErrors) {
  const TriangleMesh mesh = test::BugMesh(2);
  const test::SceneOptions options = test::MediumPhotos(8, true);
  const test::Scene scene = test::MakeScene(
      mesh, TableFromModel(ExpSo3({1.0, -2.0, 0.5}), Eigen::Vector3d(2, 1, 10)), options);
  const auto poses = SolveJoint(mesh, scene.photos, scene.masks, CoarseSearch());
  ASSERT_TRUE(poses) << ToString(poses.error());
  for (std::size_t i = 0; i < poses->views.size(); ++i) {
    EXPECT_EQ(poses->views[i].status, ViewStatus::accepted) << poses->views[i].reason;
    const PoseError error =
        ScorePose(mesh, {scene.truth[i], scene.true_intrinsics[i]},
                  {poses->views[i].camera_from_model,
                   poses->lens_states.at(poses->views[i].lens_state).intrinsics});
    EXPECT_LT(error.centre_mm, 1.0);
    EXPECT_LT(error.surface_median_px, 0.1);
  }
}

TEST(SolveJoint, AMirroredMeshIsRejected) {
  const TriangleMesh mesh = test::BugMesh(2);
  const test::SceneOptions options = test::MediumPhotos(8);
  const test::Scene scene = test::MakeScene(
      mesh, TableFromModel(ExpSo3({0.1, 0.2, 0.5}), Eigen::Vector3d(2, 1, 3)), options);
  TriangleMesh mirrored = mesh;
  for (auto& v : mirrored.vertices) v.y() = -v.y();
  for (auto& f : mirrored.faces) std::swap(f[1], f[2]);
  const auto poses = SolveJoint(mirrored, scene.photos, scene.masks, CoarseSearch());
  ASSERT_TRUE(poses) << ToString(poses.error());
  for (const ViewPose& view : poses->views) EXPECT_EQ(view.status, ViewStatus::rejected);
}

TEST(SolveJoint, AnExactBodyOfRevolutionHasAFreeAzimuth) {
  const Eigen::Vector3d axis = Eigen::Vector3d(0.2, -0.3, 1).normalized();
  const TriangleMesh mesh = test::RevolutionMesh(120, axis);
  const test::SceneOptions options = test::MediumPhotos(8, true);
  const test::Scene scene = test::MakeScene(
      mesh, TableFromModel(ExpSo3({0.3, 0.2, 0.5}), Eigen::Vector3d(2, 1, 12)), options);
  const auto poses = SolveJoint(mesh, scene.photos, scene.masks, CoarseSearch());
  ASSERT_TRUE(poses) << ToString(poses.error());
  ASSERT_EQ(poses->free_directions.size(), 1u);
  const FreeDirection& free = poses->free_directions[0];
  EXPECT_EQ(free.kind, FreeDirection::Kind::rotation);
  EXPECT_LT(DegFromRad(std::asin(std::min(1.0, free.axis.cross(axis).norm()))), 0.1);
  EXPECT_LT((free.point - free.point.dot(axis) * axis).norm(), 0.1);  // the axis passes the origin
  EXPECT_FALSE(poses->notes.empty());
  EXPECT_GT(poses->views[0].surface_sigma_px.median, 20);  // wide along what is free
  for (std::size_t i = 0; i < poses->views.size(); ++i) {
    const ViewPose& view = poses->views[i];
    EXPECT_EQ(view.status, ViewStatus::accepted) << view.reason;
    // Place and tilt are solved: the axis is where it truly is.
    const Eigen::Vector3d found = view.camera_from_model.rotation() * axis;
    EXPECT_LT(
        DegFromRad(std::asin(std::min(1.0, found.cross(scene.truth[i].rotation() * axis).norm()))),
        0.2);
  }
}

TEST(SolveJoint, AnAsymmetricBodyHasNoFreeDirection) {
  const TriangleMesh mesh = test::BugMesh(2);
  const test::SceneOptions options = test::MediumPhotos(6);
  const test::Scene scene = test::MakeScene(
      mesh, TableFromModel(ExpSo3({0.3, 0.2, 0.5}), Eigen::Vector3d(2, 1, 2)), options);
  const auto poses = SolveJoint(mesh, scene.photos, scene.masks, CoarseSearch());
  ASSERT_TRUE(poses) << ToString(poses.error());
  EXPECT_TRUE(poses->free_directions.empty());
}

}  // namespace
}  // namespace scan
