#include "reconstruction/pose/found_turntable.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "drivers/base/rng.h"
#include "drivers/base/units.h"
#include "pose_scene.h"
#include "reconstruction/pose/rig_model.h"
#include "reconstruction/pose/score.h"
#include "reconstruction/pose/solve_joint.h"

namespace scan {
namespace {

const RigidSigma kSigma{RadFromDeg(0.3), 2};

struct Found {
  PhotoSet photos;
  Poses poses;
  CameraFromStation camera_from_station;
  std::vector<double> turns_rad;
};

// Views at uneven turns, each astray by `kSigma` of its own.
Found SomeRing(int views) {
  Found f;
  f.photos.lens_states.push_back({"l0", {.w = 924, .h = 612}, {}});
  f.photos.aims.resize(1);
  f.camera_from_station = CameraFromStation(
      ExpSo3({0.1, 0.05, -0.1}) * (Eigen::Matrix3d() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished(),
      Eigen::Vector3d(3, -8, 550));
  const TableFromModel placing(ExpSo3({0.4, -0.3, 2}), Eigen::Vector3d(4, 1, 12));
  Rng rng(7);
  for (int i = 0; i < views; ++i) {
    f.turns_rad.push_back(0.35 * i + 0.05 * rng.Normal());
    Vector6d off;
    for (int k = 0; k < 6; ++k)
      off[k] = (k < 3 ? kSigma.rotation_rad : kSigma.translation_mm) * rng.Normal();
    ViewPose view;
    view.status = ViewStatus::accepted;
    // About the specimen: silhouettes tell the place of the camera less well than of its picture.
    view.camera_from_model =
        MovedAbout(f.camera_from_station * MakeStationFromTable(f.turns_rad.back()) * placing, off,
                   f.camera_from_station.translation());
    Matrix6d about = Matrix6d::Identity();
    about.bottomLeftCorner<3, 3>() = Skew(f.camera_from_station.translation());
    Vector6d sigma;
    sigma << Eigen::Vector3d::Constant(kSigma.rotation_rad),
        Eigen::Vector3d::Constant(kSigma.translation_mm);
    view.covariance = about * Matrix6d(sigma.cwiseAbs2().asDiagonal()) * about.transpose();
    f.poses.views.push_back(view);
    f.photos.photos.emplace_back();
  }
  return f;
}

TEST(FoundTurntable, AxisAndTurnsOfViewsFoundAlone) {
  const Found f = SomeRing(12);
  const auto found = FindTurntable(f.photos, f.poses, Eigen::Vector3d::Zero());
  ASSERT_TRUE(found);
  EXPECT_EQ(found->views, 12);
  const CameraFromTable first = *found->photos.photos[0].camera_from_table;
  const Eigen::Vector3d axis = f.camera_from_station.rotation().col(2);
  EXPECT_LT(std::acos(first.rotation().col(2).dot(axis)), RadFromDeg(0.3));
  const Eigen::Vector3d apart = first.translation() - f.camera_from_station.translation();
  EXPECT_LT((apart - apart.dot(axis) * axis).norm(), 3);
  for (std::size_t i = 0; i < f.turns_rad.size(); ++i) {
    const Photo& photo = found->photos.photos[i];
    const double turned =
        photo.turntable_rad->nominal - found->photos.photos[0].turntable_rad->nominal;
    EXPECT_NEAR(std::remainder(turned - (f.turns_rad[i] - f.turns_rad[0]), 2 * kPi), 0,
                RadFromDeg(1.5));
    const CameraFromModel pose = *photo.camera_from_table * found->table_from_model;
    EXPECT_LT(AngleBetween(pose.rotation(), f.poses.views[i].camera_from_model.rotation()),
              RadFromDeg(1.5));
  }
}

TEST(FoundTurntable, AViewThatStandsElsewhereIsLeftOut) {
  Found f = SomeRing(9);
  Vector6d off = Vector6d::Zero();
  off[0] = 0.2;
  ViewPose& view = f.poses.views[4];
  view.camera_from_model =
      MovedAbout(view.camera_from_model, off, f.camera_from_station.translation());
  const auto found = FindTurntable(f.photos, f.poses, Eigen::Vector3d::Zero());
  ASSERT_TRUE(found);
  EXPECT_EQ(found->views, 8);
  EXPECT_FALSE(found->photos.photos[4].camera_from_table);
}

TEST(FoundTurntable, CamerasAnywhereAreNone) {
  Found f = SomeRing(10);
  Rng rng(3);
  for (ViewPose& view : f.poses.views) {
    Vector6d off;
    for (int k = 0; k < 6; ++k) off[k] = (k < 3 ? 0.1 : 5) * rng.Normal();
    view.camera_from_model =
        MovedAbout(view.camera_from_model, off, f.camera_from_station.translation());
  }
  EXPECT_FALSE(FindTurntable(f.photos, f.poses, Eigen::Vector3d::Zero()));
}

TEST(FoundTurntable, FewViewsSmallTurnsAndFreeTurnsSayNothing) {
  EXPECT_FALSE(FindTurntable(SomeRing(5).photos, SomeRing(5).poses, Eigen::Vector3d::Zero()));
  Found f = SomeRing(12);
  for (std::size_t i = 0; i < 7; ++i) {
    f.poses.views[i].name = std::to_string(i);
    f.poses.free_directions.emplace_back().of = f.poses.views[i].name;
  }
  EXPECT_FALSE(FindTurntable(f.photos, f.poses, Eigen::Vector3d::Zero()));
  f = SomeRing(12);
  for (ViewPose& view : f.poses.views) view.camera_from_model = f.poses.views[0].camera_from_model;
  EXPECT_FALSE(FindTurntable(f.photos, f.poses, Eigen::Vector3d::Zero()));
}

// The worst error of the cameras' centres over all views.
double WorstCentre_mm(const test::Scene& scene, const TriangleMesh& mesh, const Poses& poses) {
  double worst = 0;
  for (std::size_t i = 0; i < poses.views.size(); ++i) {
    const ViewPose& view = poses.views[i];
    EXPECT_EQ(view.status, ViewStatus::accepted) << view.reason;
    const PoseError error =
        ScorePose(mesh, {scene.truth[i], scene.true_intrinsics[i]},
                  {view.camera_from_model, poses.lens_states.at(view.lens_state).intrinsics});
    worst = std::max(worst, error.centre_mm);
  }
  return worst;
}

TEST(SolveJoint, PhotographsOfATurntableWithoutALogAreSolvedAsSuch) {
  const TriangleMesh mesh = test::BugMesh(3);
  test::SceneOptions options{.w = 462, .h = 306, .views = 9};
  options.elevations_deg = {25};
  const test::Scene scene = test::MakeScene(
      mesh, TableFromModel(ExpSo3({0.05, -0.1, 1.9}), Eigen::Vector3d(1.5, -2, 3)), options);
  JointOptions alone;
  alone.no_priors = true;
  const auto poses = SolveJoint(mesh, scene.photos, scene.masks, alone);
  ASSERT_TRUE(poses) << ToString(poses.error());
  ASSERT_EQ(poses->notes.size(), 1u);
  EXPECT_NE(poses->notes.front().find("of 9 of 9 views"), std::string::npos)
      << poses->notes.front();
  EXPECT_LT(WorstCentre_mm(scene, mesh, *poses), 1.0);
}

}  // namespace
}  // namespace scan
