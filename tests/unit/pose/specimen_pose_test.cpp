// The joint solve on the synthetic specimens at full size, every placing unknown, static rig
// errors.
#include <gtest/gtest.h>

#include "drivers/base/units.h"
#include "pose_scene.h"
#include "reconstruction/pose/score.h"
#include "reconstruction/pose/solve_joint.h"
#include "reconstruction/specimens/specimen.h"

namespace scan {
namespace {

struct Solved {
  TriangleMesh mesh;
  test::Scene scene;
  Poses poses;
};

Solved SolveSpecimen(const std::string& name, int views) {
  const auto specimen = MakeSpecimen(name);
  if (!specimen) {
    ADD_FAILURE() << ToString(specimen.error());
    return {};
  }
  Solved solved;
  solved.mesh = ExactSurface(**specimen, 0.35);
  test::SceneOptions options;
  options.views = views;
  options.static_errors = true;
  // The photographs see a finer surface than the solver has.
  solved.scene = test::MakeScene(
      ExactSurface(**specimen, 0.2),
      TableFromModel(ExpSo3({0.1, -0.15, 1.3}), Eigen::Vector3d(1.5, -2, 1)), options);
  auto poses = SolveJoint(solved.mesh, solved.scene.photos, solved.scene.masks, {});
  if (!poses) {
    ADD_FAILURE() << ToString(poses.error());
    return {};
  }
  solved.poses = std::move(*poses);
  return solved;
}

void ExpectSolved(const Solved& s, double centre_mm) {
  std::vector<double> surface_px;
  for (std::size_t i = 0; i < s.poses.views.size(); ++i) {
    const ViewPose& view = s.poses.views[i];
    EXPECT_EQ(view.status, ViewStatus::accepted) << view.name << ": " << view.reason;
    const PoseError error =
        ScorePose(s.mesh, {s.scene.truth[i], s.scene.true_intrinsics[i]},
                  {view.camera_from_model, s.poses.lens_states.at(view.lens_state).intrinsics});
    EXPECT_LT(error.centre_mm, centre_mm) << view.name;
    surface_px.push_back(error.surface_median_px);
  }
  const Spread spread = SpreadOf(surface_px);
  EXPECT_LT(spread.median, 0.3);
  EXPECT_LT(spread.max, 1.0);
}

TEST(SpecimenPose, Beetle) {
  const Solved s = SolveSpecimen("beetle", 24);
  ExpectSolved(s, 1.0);
  EXPECT_TRUE(s.poses.free_directions.empty());
}

// Nearly a body of revolution: its azimuth is weak (0.15 degrees move the camera by 1.4 mm and the
// surface by 0.3 px), so only the surface is held to the bar.
TEST(SpecimenPose, Mushroom) { ExpectSolved(SolveSpecimen("mushroom", 12), 3.0); }

TEST(SpecimenPose, TomatoWithBentStalk) { ExpectSolved(SolveSpecimen("tomato-stalk", 12), 1.0); }

TEST(SpecimenPose, TheExactTomatosAzimuthIsFreeAndItsAxisFound) {
  const Solved s = SolveSpecimen("tomato", 12);
  ASSERT_EQ(s.poses.free_directions.size(), 1u);
  const FreeDirection& free = s.poses.free_directions[0];
  EXPECT_EQ(free.kind, FreeDirection::Kind::rotation);
  const auto angle_deg = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return DegFromRad(std::asin(std::min(1.0, a.cross(b).norm())));
  };
  EXPECT_LT(angle_deg(free.axis, Eigen::Vector3d::UnitZ()), 0.1);
  for (std::size_t i = 0; i < s.poses.views.size(); ++i) {
    const ViewPose& view = s.poses.views[i];
    EXPECT_EQ(view.status, ViewStatus::accepted) << view.name << ": " << view.reason;
    EXPECT_LT(
        angle_deg(view.camera_from_model.rotation().col(2), s.scene.truth[i].rotation().col(2)),
        0.15);
    EXPECT_LT((view.camera_from_model * free.point - s.scene.truth[i] * free.point).norm(), 1.5);
  }
}

}  // namespace
}  // namespace scan
