#include "reconstruction/pose/pose_spectrum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>

#include "pose_scene.h"
#include "reconstruction/pose/solve_joint.h"

namespace scan {
namespace {

TEST(SpectrumOf, NamesTheParameterOfEachDirection) {
  Eigen::Matrix3d information = Eigen::Vector3d(50, 2, 9).asDiagonal();
  const Spectrum spectrum = SpectrumOf("solve", information, {"a", "b", "c"});
  ASSERT_EQ(spectrum.lines.size(), 3u);
  EXPECT_NEAR(spectrum.lines[0].eigenvalue, 2, 1e-12);
  EXPECT_EQ(spectrum.lines[0].parameter, "b");
  EXPECT_NEAR(spectrum.lines[0].share, 1, 1e-12);
  EXPECT_EQ(spectrum.lines[2].parameter, "a");
  information(0, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(SpectrumOf("solve", information, {"a", "b", "c"}).lines.empty());
  EXPECT_TRUE(SpectrumOf("solve", Eigen::MatrixXd(), {}).lines.empty());
}

TEST(ParameterNames, AreOneForEachParameterAndNoneTwice) {
  const test::Scene scene =
      test::MakeScene(test::BugMesh(1), TableFromModel(), {.w = 120, .h = 80, .views = 4});
  const RigModel rig(scene.photos, {});
  const RigLayout layout(rig);
  const auto names = ParameterNames(scene.photos, rig, layout);
  ASSERT_EQ(names.size(), static_cast<std::size_t>(layout.size));
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
  EXPECT_EQ(std::count(names.begin(), names.end(), ""), 0);
  EXPECT_EQ(names[static_cast<std::size_t>(layout.mounting(0)) + 2], "mounting m0 turn z");
  EXPECT_EQ(names[static_cast<std::size_t>(layout.axis()) + 3], "axis shift y");
  EXPECT_EQ(names[static_cast<std::size_t>(layout.ct_scale())], "CT scale");
}

TEST(PoseDiagnostics, TellHowTheSolveConvergedAndWhatItRestsOn) {
  const TriangleMesh mesh = test::BugMesh(3);
  const TableFromModel placing(ExpSo3({0.05, -0.1, 1.9}), Eigen::Vector3d(1.5, -2, 3));
  const test::Scene scene = test::MakeScene(mesh, placing, {.w = 462, .h = 306, .views = 6});
  Vector6d off;
  off << 0.01, -0.01, 0.02, 0.2, -0.3, 0.3;
  JointOptions options;
  options.table_from_model["m0"] = MovedAbout(placing, off, Eigen::Vector3d::Zero());
  const auto poses = SolveJoint(mesh, scene.photos, scene.masks, options);
  ASSERT_TRUE(poses) << ToString(poses.error());
  const PoseDiagnostics& told = poses->diagnostics;
  ASSERT_GE(told.steps.size(), 3u);
  EXPECT_TRUE(told.steps.front().restart);
  EXPECT_TRUE(told.converged);
  EXPECT_LT(told.steps.back().moved_px, told.converged_px);
  EXPECT_GT(told.steps.front().moved_px, told.steps.back().moved_px);
  EXPECT_GT(told.steps.front().window_px, told.steps.back().window_px);
  EXPECT_GT(told.steps.front().residual_px, told.steps.back().residual_px);

  // No direction can be known worse than from its prior alone.
  const auto ascending = [](const SpectrumLine& a, const SpectrumLine& b) {
    return a.eigenvalue < b.eigenvalue;
  };
  ASSERT_FALSE(told.solve.lines.empty());
  EXPECT_TRUE(std::is_sorted(told.solve.lines.begin(), told.solve.lines.end(), ascending));
  EXPECT_GT(told.solve.lines.front().eigenvalue, 1 - 1e-6);
  // The placing's prior is 100 mm: the photographs and what is logged of the camera leave less than
  // a twentieth of it in every direction.
  ASSERT_EQ(told.placings.size(), 1u);
  EXPECT_EQ(told.placings[0].of, "m0");
  ASSERT_EQ(told.placings[0].lines.size(), 6u);
  EXPECT_GT(told.placings[0].lines.front().eigenvalue, 1 / (5.0 * 5.0));
}

}  // namespace
}  // namespace scan
