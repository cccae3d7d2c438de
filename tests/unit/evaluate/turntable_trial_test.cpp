#include "reconstruction/evaluate/turntable_trial.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <opencv2/core.hpp>

#include "drivers/base/units.h"
#include "pose_scene.h"

namespace scan {
namespace {

PoseTrial SceneTrial(int views = 8) {
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

TEST(TurntableTrial, MasksDrawnWithoutErrorsAreThePhotographs) {
  const PoseTrial captured = SceneTrial();
  PoseTrial drawn = captured;
  DrawMasks(drawn, {});
  ASSERT_EQ(drawn.masks.size(), captured.masks.size());
  for (std::size_t i = 0; i < drawn.masks.size(); ++i)
    EXPECT_LE(cv::norm(drawn.masks[i].coverage, captured.masks[i].coverage, cv::NORM_INF), 24)
        << "of 255, another renderer's; view " << i;
}

TEST(TurntableTrial, ALargerPictureShowsTheSame) {
  const PoseTrial captured = SceneTrial();
  PoseTrial larger = captured;
  StateErrors(larger, {.w = 924});
  DrawMasks(larger, {});
  const LensState &was = captured.photos.lens_states[0], &is = larger.photos.lens_states[0];
  EXPECT_EQ(is.intrinsics.h, 612);
  EXPECT_DOUBLE_EQ(is.intrinsics.fl_x, 2 * was.intrinsics.fl_x);
  EXPECT_DOUBLE_EQ(is.sigma.c_px, 2 * was.sigma.c_px);
  EXPECT_DOUBLE_EQ(is.sigma.fl_rel, was.sigma.fl_rel);
  for (std::size_t i = 0; i < larger.masks.size(); ++i) {
    const double area = cv::sum(larger.masks[i].coverage)[0];
    EXPECT_NEAR(area / cv::sum(captured.masks[i].coverage)[0], 4, 0.02) << i;
    EXPECT_EQ(larger.truth[i].intrinsics.w, 924);
  }
}

TEST(TurntableTrial, AMeshOfAnotherThresholdLiesOutsideOfTheSurface) {
  PoseTrial trial = SceneTrial();
  trial.mesh = trial.surface = test::RevolutionMesh(60, {0, 0, 1});
  const double volume = SignedVolume(trial.mesh);
  OffsetMesh(trial, 0.1);
  // Area of a body this round, about 4 pi 11^2.
  EXPECT_NEAR((SignedVolume(trial.mesh) - volume) / (0.1 * 4 * kPi * 11 * 11), 1, 0.2);
  EXPECT_DOUBLE_EQ(SignedVolume(trial.surface), volume);
}

TEST(TurntableTrial, OnlyWhatIsStatedGoesWrong) {
  const PoseTrial captured = SceneTrial();
  PoseTrial wrong = captured;
  StateErrors(
      wrong,
      {.focal_error_rel = 0.01, .turntable_sigma_rad = RadFromDeg(0.1), .lift_sigma_mm = 0.2});
  const LensState &was = captured.photos.lens_states[0], &is = wrong.photos.lens_states[0];
  EXPECT_NEAR(is.intrinsics.fl_x, 1.01 * was.intrinsics.fl_x, 1e-9);
  EXPECT_NEAR(is.intrinsics.fl_y, 1.01 * was.intrinsics.fl_y, 1e-9);
  EXPECT_GE(is.sigma.fl_rel, 0.01);
  EXPECT_EQ(is.intrinsics.cx, was.intrinsics.cx);
  for (std::size_t i = 0; i < wrong.photos.photos.size(); ++i) {
    const Photo& photo = wrong.photos.photos[i];
    EXPECT_EQ(wrong.truth[i].intrinsics, captured.truth[i].intrinsics);
    ASSERT_TRUE(photo.turntable_rad);
    EXPECT_EQ(photo.turntable_rad->nominal, captured.photos.photos[i].turntable_rad->nominal);
    EXPECT_EQ(photo.turntable_rad->sigma_view, RadFromDeg(0.1));
    ASSERT_TRUE(photo.lift_mm);
    EXPECT_EQ(photo.lift_mm->sigma_view, 0.2);
  }
}

TEST(TurntableTrial, OutlinesStrayAlikeForAnyNumberOfThreads) {
  const auto with_threads = [](std::size_t threads, std::uint64_t seed) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    PoseTrial trial = SceneTrial(2);
    DrawMasks(trial, {.noise = {.sigma_px = 0.5, .bias_px = 0.7}, .seed = seed});
    return trial.masks;
  };
  const auto one = with_threads(1, 5), two = with_threads(2, 5), other = with_threads(2, 6);
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(cv::norm(one[i].coverage, two[i].coverage, cv::NORM_L1), 0) << i;
    EXPECT_GT(cv::norm(one[i].coverage, other[i].coverage, cv::NORM_L1), 0) << i;
  }
}

}  // namespace
}  // namespace scan
