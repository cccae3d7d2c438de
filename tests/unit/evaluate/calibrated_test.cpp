#include "reconstruction/evaluate/calibrated.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "drivers/base/files.h"
#include "drivers/base/units.h"
#include "pose_scene.h"
#include "reconstruction/pose/rigid_motion.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

using ModelFromModel = Transform<frame::Model, frame::Model>;

// One turn of the platter seen by one aim; solved and calibrated cameras are both the truth.
struct CalibratedCase {
  TriangleMesh mesh = test::BugMesh(2);
  test::Scene scene;
  Poses poses;
  CalibratedCameras calibrated;

  Result<CalibratedFigures> Compare() const {
    return CompareWithCalibrated(poses, calibrated, mesh, scene.photos, scene.masks);
  }
};

CalibratedCase MakeCalibratedCase() {
  CalibratedCase c;
  test::SceneOptions options;
  options.w = 462;
  options.h = 306;
  options.views = 6;
  options.elevations_deg = {30};
  c.scene = test::MakeScene(c.mesh, TableFromModel(ExpSo3({0.1, -0.2, 0.7}), {1, -1, 2}), options);
  c.calibrated.intrinsics = c.scene.true_intrinsics[0];
  for (std::size_t i = 0; i < c.scene.truth.size(); ++i) {
    ViewPose view;
    view.name = c.scene.photos.photos[i].name;
    view.lens_state = "lens0";
    view.status = ViewStatus::accepted;
    view.camera_from_model = c.scene.truth[i];
    c.poses.views.push_back(view);
    c.calibrated.views[view.name] = c.scene.truth[i];
  }
  c.poses.lens_states["lens0"].intrinsics = c.scene.true_intrinsics[0];
  c.poses.axis_in_camera["a0"].direction =
      c.scene.photos.aims[0].camera_from_lift->rotation() * Eigen::Vector3d::UnitZ();
  return c;
}

TEST(CompareWithCalibrated, TheSameCamerasAgree) {
  const auto figures = MakeCalibratedCase().Compare();
  ASSERT_TRUE(figures) << ToString(figures.error());
  EXPECT_EQ(figures->views, 6u);
  EXPECT_EQ(figures->accepted, 6u);
  EXPECT_LT(figures->aligned_deg.max, 1e-5);
  EXPECT_LT(figures->neighbour_deg.max, 1e-5);
  ASSERT_TRUE(figures->axis_deg);
  EXPECT_LT(*figures->axis_deg, 1e-5);
  EXPECT_LT(figures->contour.px.median, 0.3);
  EXPECT_EQ(figures->contour.px.median, figures->contour_calibrated.px.median);
}

TEST(CompareWithCalibrated, RotationsDoNotDependOnTheCalibrationsOwnFrame) {
  CalibratedCase c = MakeCalibratedCase();
  const ModelFromModel own(ExpSo3({0.4, 1.1, -0.8}), Eigen::Vector3d(30, -20, 5));
  for (auto& [name, pose] : c.calibrated.views) pose = pose * own;
  const auto figures = c.Compare();
  ASSERT_TRUE(figures) << ToString(figures.error());
  EXPECT_LT(figures->aligned_deg.max, 1e-5);
  EXPECT_LT(figures->neighbour_deg.max, 1e-5);
  EXPECT_LT(*figures->axis_deg, 1e-5);
}

TEST(CompareWithCalibrated, ErrorsComeOutInTheirUnits) {
  CalibratedCase c = MakeCalibratedCase();
  // One camera of six turned by a degree: both steps to its neighbours are off by as much.
  CameraFromModel& turned = c.poses.views[2].camera_from_model;
  turned = CameraFromModel(ExpSo3({0, 0, RadFromDeg(1)}) * turned.rotation(), turned.translation());
  AxisInCamera& axis = c.poses.axis_in_camera["a0"];
  const Eigen::Vector3d across = axis.direction.unitOrthogonal();
  axis.direction = ExpSo3(RadFromDeg(2) * across) * axis.direction;
  const auto figures = c.Compare();
  ASSERT_TRUE(figures) << ToString(figures.error());
  EXPECT_NEAR(figures->neighbour_deg.max, 1, 1e-6);
  EXPECT_NEAR(figures->neighbour_deg.median, 0, 1e-5);
  EXPECT_NEAR(figures->aligned_deg.max, 5.0 / 6, 0.02);  // the alignment takes a sixth
  EXPECT_NEAR(*figures->axis_deg, 2, 1e-5);
}

TEST(CompareWithCalibrated, MasksCutTooWideAreToldFromPosesThatAreOff) {
  CalibratedCase c = MakeCalibratedCase();
  for (Mask& mask : c.scene.masks) cv::dilate(mask.coverage, mask.coverage, {});
  // By a pixel along rows and columns, by its diagonal else.
  const auto figures = c.Compare();
  ASSERT_TRUE(figures) << ToString(figures.error());
  EXPECT_GT(figures->contour.swell_px, 0.95);
  EXPECT_LT(figures->contour.swell_px, 1.45);
  EXPECT_GT(figures->contour.px.median, 0.95);
  EXPECT_LT(figures->contour.even_px.median, 0.3);
}

TEST(CompareWithCalibrated, AShiftedModelMovesItsOutline) {
  CalibratedCase c = MakeCalibratedCase();
  // 0.5 mm to the right at about 550 mm: 1.25 px.
  for (ViewPose& view : c.poses.views)
    view.camera_from_model =
        CameraFromModel(view.camera_from_model.rotation(),
                        view.camera_from_model.translation() + Eigen::Vector3d(0.5, 0, 0));
  const auto figures = c.Compare();
  ASSERT_TRUE(figures) << ToString(figures.error());
  EXPECT_GT(figures->contour.px.median, 0.4);
  EXPECT_LT(figures->contour.px.median, 1.3);
  EXPECT_LT(figures->contour_calibrated.px.median, 0.3);
}

TEST(CompareWithCalibrated, LensParametersBesideTheNominalAndTheCalibrated) {
  CalibratedCase c = MakeCalibratedCase();
  const Intrinsics nominal = c.scene.photos.lens_states[0].intrinsics;
  c.calibrated.intrinsics.cx = nominal.cx + 3;
  c.calibrated.intrinsics.fl_x = 1.01 * nominal.fl_x;
  c.poses.lens_states["lens0"].parameters["cx"] = {nominal.cx + 1, 0.5, 2};
  c.poses.lens_states["lens0"].parameters["fl_rel"] = {0.004, 0.001, 0.01};
  const auto figures = c.Compare();
  ASSERT_TRUE(figures) << ToString(figures.error());
  ASSERT_EQ(figures->lens.size(), 2u);
  EXPECT_EQ(figures->lens[0].name, "cx");
  EXPECT_NEAR(figures->lens[0].moved, 1, 1e-9);
  EXPECT_NEAR(figures->lens[0].truth, 3, 1e-9);
  EXPECT_EQ(figures->lens[1].moved, 0.004);
  EXPECT_NEAR(figures->lens[1].truth, std::log(1.01), 1e-9);
  EXPECT_EQ(figures->lens[1].prior_sigma, 0.01);
}

TEST(CompareWithCalibrated, TooFewViewsOrOtherPicturesAreBadInput) {
  CalibratedCase c = MakeCalibratedCase();
  c.calibrated.intrinsics.w *= 2;
  auto figures = c.Compare();
  ASSERT_FALSE(figures);
  EXPECT_NE(ToString(figures.error()).find("924 x 306"), std::string::npos);
  c = MakeCalibratedCase();
  for (std::size_t i = 0; i < 2; ++i) c.poses.views[i].status = ViewStatus::rejected;
  c.calibrated.views.erase(c.poses.views[3].name);
  figures = c.Compare();
  ASSERT_TRUE(figures) << "three are left";
  EXPECT_EQ(figures->accepted, 4u);
  c.poses.views[2].status = ViewStatus::rejected;
  figures = c.Compare();
  ASSERT_FALSE(figures);
  EXPECT_EQ(figures.error().kind, ErrorKind::bad_input);
}

TEST(ReadCalibrated, WhatItHoldsAndWhatIsWrongWithIt) {
  const TempFolder folder;
  const auto path = folder.path() / "truth.json";
  const auto read = [&](const std::string& focal, const std::string& first) {
    EXPECT_TRUE(WriteFileDurably(
        path, "{\"fx\":" + focal + ",\"fy\":1001,\"cx\":50,\"cy\":40,\"w\":100,\"h\":80," +
                  "\"views\":{\"a\":[[" + first + ",0,0,1],[0,1,0,2],[0,0,1,300]]}}"));
    return ReadCalibrated(path);
  };
  const auto cameras = read("1000", "1");
  ASSERT_TRUE(cameras) << ToString(cameras.error());
  EXPECT_EQ(cameras->intrinsics, (Intrinsics{100, 80, 1000, 1001, 50, 40}));
  EXPECT_EQ(cameras->views.at("a").translation(), Eigen::Vector3d(1, 2, 300));
  const auto refused = [](const Result<CalibratedCameras>& result, const std::string& word) {
    ASSERT_FALSE(result) << word;
    EXPECT_EQ(result.error().kind, ErrorKind::bad_input);
    EXPECT_NE(ToString(result.error()).find(word), std::string::npos) << ToString(result.error());
  };
  refused(read("0", "1"), "fx");
  refused(read("\"long\"", "1"), "fx");
  refused(read("1000", "2"), "views.a");  // no rotation
  refused(read("1000", "null"), "views.a");
  refused(read("1000", "1]"), "truth.json");
  refused(ReadCalibrated(folder.path() / "none.json"), "none.json");
}

}  // namespace
}  // namespace scan
