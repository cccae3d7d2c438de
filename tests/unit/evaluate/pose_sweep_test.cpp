#include "reconstruction/evaluate/pose_sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pose_scene.h"
#include "reconstruction/pose/nominal_pose.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

PoseTrial SweepTrial(int views) {
  PoseTrial trial;
  trial.surface = trial.mesh = test::BugMesh(1);
  test::SceneOptions options;
  options.w = 462;
  options.h = 306;
  options.views = views;
  test::Scene scene = test::MakeScene(trial.mesh, TableFromModel(), options);
  trial.photos = scene.photos;
  trial.masks = scene.masks;
  for (std::size_t i = 0; i < scene.truth.size(); ++i)
    trial.truth.push_back({scene.truth[i], scene.true_intrinsics[i]});
  return trial;
}

TEST(DisplaceLoggedPoses, MovesByTheSigmaAndStatesIt) {
  const PoseTrial captured = SweepTrial(40);
  PoseTrial displaced = captured;
  DisplaceLoggedPoses(displaced, {0.02, 0.5}, 3);
  double turns = 0, shifts = 0;
  for (std::size_t i = 0; i < displaced.photos.photos.size(); ++i) {
    const Photo& photo = displaced.photos.photos[i];
    const auto was = NominalCameraFromTable(captured.photos, captured.photos.photos[i]);
    const auto is = NominalCameraFromTable(displaced.photos, photo);
    ASSERT_TRUE(was && is);
    const Vector6d motion = MotionBetween(*was, *is, Eigen::Vector3d::Zero());
    turns += motion.head<3>().squaredNorm();
    shifts += motion.tail<3>().squaredNorm();
    EXPECT_NEAR(photo.sigma_view.rotation_rad,
                std::hypot(captured.photos.photos[i].sigma_view.rotation_rad, 0.02), 1e-12);
    EXPECT_NEAR(photo.sigma_view.translation_mm,
                std::hypot(captured.photos.photos[i].sigma_view.translation_mm, 0.5), 1e-12);
  }
  // 120 draws each: within three of their sigmas.
  const double n = 3.0 * static_cast<double>(displaced.photos.photos.size());
  EXPECT_NEAR(std::sqrt(turns / n), 0.02, 0.02 * 3 / std::sqrt(2 * n));
  EXPECT_NEAR(std::sqrt(shifts / n), 0.5, 0.5 * 3 / std::sqrt(2 * n));
}

TEST(PoseSweep, ErrorsGrowWithTheNoiseAndEveryPointIsInTheTable) {
  const PoseTrial trial = SweepTrial(4);
  const std::array<double, 2> sigma_px{0, 2};
  const auto points = SweepNoise(trial, sigma_px, {}, {}, {});
  ASSERT_TRUE(points) << ToString(points.error());
  ASSERT_EQ(points->size(), 4u);
  const auto at = [&](double sigma, bool priors) {
    return std::find_if(points->begin(), points->end(),
                        [&](const SweepPoint& p) { return p.at == sigma && p.priors == priors; })
        ->summary;
  };
  EXPECT_EQ(at(0, true).accepted, 4u);
  EXPECT_LT(at(0, true).surface_px.median, at(2, true).surface_px.median);
  EXPECT_LT(at(0, true).surface_px.median, 0.3);
  const std::string table = TableOf(*points, "outlines stray by, px");
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 5);
  EXPECT_NE(table.find("not used"), std::string::npos);
}

TEST(PoseSweep, WithoutLoggedPosesTheirErrorsDoNotMatter) {
  const PoseTrial trial = SweepTrial(4);
  const std::array<double, 2> sigma{0.02, 0.5};
  const auto points = SweepPriors(trial, sigma, {}, {}, {});
  ASSERT_TRUE(points) << ToString(points.error());
  ASSERT_EQ(points->size(), 4u);
  const auto& all = *points;
  EXPECT_TRUE(all[0].priors && !all[1].priors && all[2].priors && !all[3].priors);
  EXPECT_EQ(all[1].summary.centre_mm.median, all[3].summary.centre_mm.median);
  EXPECT_EQ(all[1].at, 0.02);
  EXPECT_LT(all[0].summary.centre_mm.median, all[2].summary.centre_mm.median);
  EXPECT_TRUE(SweepPriors(trial, {}, {}, {}, {})->empty());
}

}  // namespace
}  // namespace scan
