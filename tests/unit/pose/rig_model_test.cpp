#include "reconstruction/pose/rig_model.h"

#include <gtest/gtest.h>

#include "drivers/base/rng.h"
#include "pose_scene.h"
#include "reconstruction/pose/rig_solve.h"

namespace scan {
namespace {

struct Rigged {
  test::Scene scene;
  RigModel rig;
  RigParameters parameters;
};

// A rig off its nominal state in every parameter.
Rigged SomeRig() {
  test::SceneOptions options;
  options.w = 160;
  options.h = 120;
  options.views = 4;
  test::Scene scene = test::MakeScene(
      test::BugMesh(0), TableFromModel(ExpSo3({0.1, 0.2, 1.0}), Eigen::Vector3d(1, 2, 3)), options);
  RigModel rig(scene.photos, {});
  rig.set_start(0, scene.table_from_model);
  RigParameters p = rig.Nominal();
  Rng rng(5);
  const auto fill = [&](auto& block, double size) {
    for (double& x : block) x = size * rng.Uniform(-1, 1);
  };
  for (auto& b : p.mountings) fill(b, 0.1);
  fill(p.epochs, 0.05);
  for (auto& b : p.aims) fill(b, 0.02);
  fill(p.axis, 0.02);
  for (auto& b : p.lenses) fill(b, 0.01);
  for (auto& b : p.views) fill(b, 0.02);
  p.log_ct_scale = 0.01;
  p.mask_bias_px = 0.3;
  return {std::move(scene), std::move(rig), std::move(p)};
}

TEST(RigModel, NominalParametersGiveTheLoggedPoses) {
  const Rigged r = SomeRig();
  for (int i = 0; i < 4; ++i) {
    const CameraFromModel pose = r.rig.CameraFromModelOf(r.rig.Nominal(), i);
    EXPECT_LT((pose.matrix34() - r.scene.truth[static_cast<std::size_t>(i)].matrix34()).norm(),
              1e-9);
  }
}

TEST(RigModel, ASplitThatIsTakenBackLeavesNothing) {
  Rigged r = SomeRig();
  const RigModel before = r.rig;
  const RigParameters parameters = r.parameters;
  r.rig.SplitEpoch(1, "1-from-b", 0.3, r.parameters);
  r.rig.SplitEpoch(3, "1-from-b-from-d", 0.3, r.parameters);
  r.parameters.epochs.back() += 0.1;
  r.rig.JoinEpoch(1, 0, r.parameters);
  EXPECT_EQ(r.rig.epoch_names(), (std::vector<std::string>{"1", "1-from-d"}));
  ASSERT_EQ(r.parameters.epochs.size(), 2u);
  EXPECT_EQ(r.parameters.epochs.back(), parameters.epochs.front() + 0.1);
  for (int i = 0; i < 4; ++i) {
    const double moved = (r.rig.CameraFromModelOf(r.parameters, i).matrix34() -
                          before.CameraFromModelOf(parameters, i).matrix34())
                             .norm();
    if (i < 3)
      EXPECT_EQ(moved, 0) << i;
    else
      EXPECT_GT(moved, 0.01);
  }
}

TEST(RigModel, DistortionIsThatOfThePicturesCorner) {
  Rigged r = SomeRig();
  r.parameters.lenses[0] = {0, 0, 0, 0.01};
  Intrinsics in = r.rig.IntrinsicsOf(r.parameters, 0);
  const Eigen::Vector2d corner(0.5 * in.w / in.fl_x, 0.5 * in.h / in.fl_y);
  EXPECT_LT((Distort(in, corner) - 1.01 * corner).norm(), 1e-12);
}

TEST(RigModel, CtScaleIsDividedOutOfTheTranslation) {
  Rigged r = SomeRig();
  r.parameters.log_ct_scale = 0;
  const CameraFromModel plain = r.rig.CameraFromModelOf(r.parameters, 1);
  r.parameters.log_ct_scale = std::log(1.02);
  const CameraFromModel scaled = r.rig.CameraFromModelOf(r.parameters, 1);
  EXPECT_LT((scaled.rotation() - plain.rotation()).norm(), 1e-12);
  EXPECT_LT((1.02 * scaled.translation() - plain.translation()).norm(), 1e-9);
}

TEST(ViewJacobian, AgreesWithDifferencesInEveryParameter) {
  Rigged r = SomeRig();
  const RigLayout layout(r.rig);
  const int view = 3;
  const CameraFromModel at = r.rig.CameraFromModelOf(r.parameters, view);
  const Eigen::Vector3d pivot = at * Eigen::Vector3d(0, 0, 8);
  const Eigen::MatrixXd J = ViewJacobian(r.rig, layout, r.parameters, view, pivot);
  ASSERT_EQ(J.cols(), layout.size);
  const auto check = [&](double& x, int column) {
    const double h = 1e-6, before = x;
    x = before + h;
    const Vector6d up = MotionBetween(at, r.rig.CameraFromModelOf(r.parameters, view), pivot);
    x = before - h;
    const Vector6d down = MotionBetween(at, r.rig.CameraFromModelOf(r.parameters, view), pivot);
    x = before;
    const Vector6d difference = (up - down) / (2 * h);
    EXPECT_LT((J.col(column).head<6>() - difference).norm(), 1e-5 * (1 + difference.norm()))
        << column;
  };
  for (int k = 0; k < 6; ++k) check(r.parameters.mountings[0][k], layout.mounting(0) + k);
  check(r.parameters.epochs[0], layout.epoch(0));
  for (int k = 0; k < 6; ++k) check(r.parameters.aims[1][k], layout.aim(1) + k);
  for (int k = 0; k < 4; ++k) check(r.parameters.axis[k], layout.axis() + k);
  for (int k = 0; k < 8; ++k) check(r.parameters.views[3][k], layout.view(3) + k);
  check(r.parameters.log_ct_scale, layout.ct_scale());
  EXPECT_EQ(J(9, layout.mask_bias()), 1);
  EXPECT_EQ(J.col(layout.aim(0)).norm(), 0);  // the other aim
}

}  // namespace
}  // namespace scan
