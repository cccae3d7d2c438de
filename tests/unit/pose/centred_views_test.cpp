#include "reconstruction/pose/centred_views.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "drivers/base/rng.h"
#include "drivers/base/units.h"
#include "pose_scene.h"
#include "reconstruction/pose/nominal_pose.h"
#include "reconstruction/pose/score.h"
#include "reconstruction/pose/solve_joint.h"

namespace scan {
namespace {

constexpr double kReach_px = 8;

// A photograph's logged pose moved about its camera, and its sigma stated.
void Displace(PhotoSet& photos, std::size_t i, const Vector6d& motion, const RigidSigma& sigma) {
  Photo& photo = photos.photos[i];
  const CameraFromTable logged = *NominalCameraFromTable(photos, photo);
  photo.camera_from_table = MovedAbout(logged, motion, Eigen::Vector3d::Zero());
  photo.sigma_view = sigma;
}

struct Displaced {
  TriangleMesh triangles = test::BugMesh(2);
  ContourMesh mesh{triangles};
  test::Scene scene =
      test::MakeScene(triangles, TableFromModel(ExpSo3({0.1, 0.2, 1.0}), Eigen::Vector3d(1, 2, 3)),
                      {.w = 924, .h = 612, .views = 4});
  std::vector<PhotoContour> contours;

  RigParameters Centre() {
    contours.clear();
    for (const Mask& mask : scene.masks) contours.push_back(MakePhotoContour(mask));
    RigModel rig(scene.photos, {});
    rig.set_start(0, scene.table_from_model);
    return CentredViews(mesh, rig, contours, std::vector<bool>(4, true), kReach_px);
  }
};

Vector6d Motion(double turn_deg, double shift_mm) {
  Vector6d motion;
  motion << RadFromDeg(turn_deg), -RadFromDeg(turn_deg), 0, shift_mm, 0, 0;
  return motion;
}

TEST(CentredViews, AViewThatTheLogKnowsLooselyIsTurnedBack) {
  Displaced d;
  const Vector6d off = Motion(1.5, 0);
  Displace(d.scene.photos, 1, off, {RadFromDeg(2), 0});
  const RigParameters centred = d.Centre();
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(centred.views[1][2 + k], -off[k], 0.002) << k;
  for (const std::size_t i : {0, 2, 3})
    EXPECT_TRUE(std::all_of(centred.views[i].begin(), centred.views[i].end(),
                            [](double x) { return x == 0; }));
}

TEST(CentredViews, AViewThatMayHaveShiftedIsShifted) {
  Displaced d;
  Displace(d.scene.photos, 2, Motion(0, 20), {0, 20});
  const RigParameters centred = d.Centre();
  EXPECT_NEAR(centred.views[2][5], -20, 0.5);
  EXPECT_NEAR(centred.views[2][3], 0, 1e-3);
}

TEST(CentredViews, WhatTheLogExcludesOrKnowsStays) {
  Displaced d;
  Displace(d.scene.photos, 0, Motion(3, 0), {RadFromDeg(0.5), 0});  // 8 sigma
  Displace(d.scene.photos, 1, Motion(0.1, 0), {RadFromDeg(0.1), 0.1});
  const RigParameters centred = d.Centre();
  for (const std::size_t i : {0, 1})
    EXPECT_TRUE(std::all_of(centred.views[i].begin(), centred.views[i].end(), [](double x) {
      return x == 0;
    })) << i;
}

// 2 degrees are 63 px of the picture here, about the contours' search window.
TEST(SolveJoint, PosesLoggedLooselyAreStillPriors) {
  const TriangleMesh mesh = test::BugMesh(3);
  test::Scene scene =
      test::MakeScene(mesh, TableFromModel(ExpSo3({0.05, -0.1, 1.9}), Eigen::Vector3d(1.5, -2, 3)),
                      {.w = 924, .h = 612, .views = 8});
  const RigidSigma sigma{RadFromDeg(2), 2};
  Rng rng(3);
  for (std::size_t i = 0; i < scene.photos.photos.size(); ++i) {
    Vector6d motion;
    for (int k = 0; k < 6; ++k)
      motion[k] = (k < 3 ? sigma.rotation_rad : sigma.translation_mm) * rng.Normal();
    Displace(scene.photos, i, motion, sigma);
  }
  const auto poses = SolveJoint(mesh, scene.photos, scene.masks, {});
  ASSERT_TRUE(poses) << ToString(poses.error());
  for (std::size_t i = 0; i < poses->views.size(); ++i) {
    const ViewPose& view = poses->views[i];
    EXPECT_EQ(view.status, ViewStatus::accepted) << view.name << ": " << view.reason;
    const PoseError error =
        ScorePose(mesh, {scene.truth[i], scene.true_intrinsics[i]},
                  {view.camera_from_model, poses->lens_states.at(view.lens_state).intrinsics});
    EXPECT_LT(error.surface_median_px, 0.1) << view.name;
  }
}

}  // namespace
}  // namespace scan
