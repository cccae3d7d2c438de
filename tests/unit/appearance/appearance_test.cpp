// The azimuth of an exact body of revolution from its colour.
#include "reconstruction/appearance/appearance.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "coloured_scene.h"
#include "drivers/base/rng.h"
#include "drivers/base/units.h"
#include "reconstruction/pose/rigid_motion.h"
#include "reconstruction/pose/solve_joint.h"

namespace scan {
namespace {

std::shared_ptr<const Specimen> Named(std::string_view name) {
  return std::shared_ptr<const Specimen>(std::move(*MakeSpecimen(name)));
}

const test::ColouredScene& Flushed() {
  static const test::ColouredScene scene =
      test::MakeColouredScene(Named("tomato-flushed"), test::MediumPhotos(8, true), 0.4);
  return scene;
}

double LargestDeg(const std::vector<double>& angles, double from = 0) {
  double largest = 0;
  for (const double a : angles)
    largest = std::max(largest, std::abs(std::remainder(a - from, 2 * kPi)));
  return DegFromRad(largest);
}

// CT to surface, photographs to masks, the joint solve, then colour.
TEST(Appearance, ColourThatFollowsDensityGivesTheTomatosAzimuth) {
  const test::ColouredScene& s = Flushed();
  auto poses = SolveJoint(s.mesh, s.scene.photos, s.scene.masks, {});
  ASSERT_TRUE(poses) << ToString(poses.error());
  ASSERT_EQ(poses->free_directions.size(), 1u);
  AppearanceOptions options;
  options.views_alone = 4;
  const auto finding = FindAppearance(s.mesh, &s.volume, s.scene.photos, s.scene.masks, *poses,
                                      poses->free_directions[0], options);
  ASSERT_TRUE(finding) << ToString(finding.error());
  ASSERT_TRUE(finding->turn.decided) << finding->turn.reason;
  ApplyAppearance(s.mesh, s.scene.photos, *finding, {}, *poses);
  const std::vector<double> errors = test::AzimuthErrors(s, *poses);
  RecordProperty("azimuth_error_deg", fmt::format("{:.3f}", LargestDeg(errors)));
  RecordProperty("sigma_deg", fmt::format("{:.3f}", DegFromRad(finding->turn.sigma_rad)));
  RecordProperty("view_spread_deg", fmt::format("{:.3f}", LargestDeg(errors, errors[0])));
  RecordProperty("views_alone",
                 fmt::format("{} of {}", finding->agree_alone, finding->searched_alone));
  EXPECT_LT(LargestDeg(errors), 1.0);
  EXPECT_LT(LargestDeg(errors, errors[0]), 0.3);
  EXPECT_TRUE(poses->free_directions.empty());
  for (const ViewPose& view : poses->views) {
    const Eigen::Vector3d axis = view.camera_from_model.rotation().col(2);
    EXPECT_LT(axis.dot(view.covariance.topLeftCorner<3, 3>() * axis), std::pow(RadFromDeg(2), 2));
    EXPECT_LT(view.surface_sigma_px.median, 3);
  }
}

// Photographs twice as sharp of the tomato, no CT: what views show of each other.
const test::ColouredScene& SharpTomato() {
  static const test::ColouredScene scene = [] {
    test::SceneOptions options = test::MediumPhotos(6, true);
    options.elevations_deg = {20};
    options.focal_mm = 140;
    return test::MakeColouredScene(Named("tomato"), options, 0);
  }();
  return scene;
}

AppearanceFinding Find(const test::ColouredScene& s, const Poses& poses, const Volume* volume) {
  const auto finding = FindAppearance(s.mesh, volume, s.scene.photos, s.scene.masks, poses,
                                      poses.free_directions.at(0));
  if (!finding) {
    ADD_FAILURE() << ToString(finding.error());
    return {};
  }
  return *finding;
}

// At the true poses but for the common turn.
const AppearanceFinding& Aligned() {
  static const AppearanceFinding finding =
      Find(SharpTomato(), test::PosesTurnedBy(SharpTomato(), 0.6, {}), nullptr);
  return finding;
}

bool AnyNote(const Poses& poses, const std::string& part) {
  return std::any_of(poses.notes.begin(), poses.notes.end(),
                     [&](const std::string& note) { return note.find(part) != note.npos; });
}

TEST(Appearance, WithoutACtViewsAgreeAndTheTurnStaysFree) {
  const test::ColouredScene& s = SharpTomato();
  Poses poses = test::PosesTurnedBy(s, 0.6, {});
  const Poses before = poses;
  const AppearanceFinding& finding = Aligned();
  EXPECT_FALSE(finding.turn.decided);
  EXPECT_EQ(std::count(finding.corrected.begin(), finding.corrected.end(), true), 0);
  EXPECT_LT(DegFromRad(finding.view_spread_rad), 0.2);
  EXPECT_GT(finding.before.share, 0.8);
  ApplyAppearance(s.mesh, s.scene.photos, finding, {}, poses);
  EXPECT_EQ(poses.free_directions.size(), 1u);
  EXPECT_TRUE(AnyNote(poses, "colour does not decide the turn"));
  for (std::size_t i = 0; i < poses.views.size(); ++i) {
    EXPECT_TRUE(poses.views[i].camera_from_model.matrix34().isApprox(
        before.views[i].camera_from_model.matrix34(), 0.0));
    EXPECT_EQ(poses.views[i].covariance, before.views[i].covariance);
  }
}

TEST(Appearance, ViewsAstrayByAThirdOfADegreeAreFoundAndTurnedBack) {
  const test::ColouredScene& s = SharpTomato();
  const double astray = RadFromDeg(0.3);
  Poses poses = test::PosesTurnedBy(s, 0.6, {0, astray, 0, 0, -astray, 0});
  const AppearanceFinding finding = Find(s, poses, nullptr);
  for (std::size_t k = 0; k < 6; ++k) EXPECT_EQ(finding.corrected[k], k == 1 || k == 4) << k;
  EXPECT_GT(finding.after.share, finding.before.share);
  ApplyAppearance(s.mesh, s.scene.photos, finding, {}, poses);
  std::vector<double> errors = test::AzimuthErrors(s, poses);
  RecordProperty("left_deg", fmt::format("{:.3f}", LargestDeg(errors, -0.6)));
  EXPECT_LT(LargestDeg(errors, -0.6), 0.15);
  EXPECT_TRUE(AnyNote(poses, "v001, v004"));
}

TEST(Appearance, AgreementNamesAWrongTurntableAxis) {
  const test::ColouredScene& s = SharpTomato();
  std::vector<double> once_round;
  for (const Photo& photo : s.scene.photos.photos)
    once_round.push_back(RadFromDeg(1.0) * std::cos(photo.turntable_rad->nominal + 0.7));
  Poses poses = test::PosesTurnedBy(s, 0.6, once_round);
  const AppearanceFinding finding = Find(s, poses, nullptr);
  EXPECT_NEAR(DegFromRad(finding.once_round_rad), 1.0, 0.15);
  EXPECT_LT(finding.before.share, Aligned().before.share);
  ApplyAppearance(s.mesh, s.scene.photos, finding, {}, poses);
  EXPECT_TRUE(AnyNote(poses, "its axis is not where the poses have it"));
  EXPECT_LT(LargestDeg(test::AzimuthErrors(s, poses), -0.6), 0.2);
}

// Seed chambers under a painted skin that has nothing to do with them.
TEST(Appearance, ColourThatFollowsNothingLeavesTheTurnFree) {
  test::SceneOptions options = test::MediumPhotos(4, true);
  options.elevations_deg = {20};
  const test::ColouredScene s = test::MakeColouredScene(Named("tomato"), options, 0.5);
  const Poses poses = test::PosesTurnedBy(s, 0.6, {});
  const AppearanceFinding finding = Find(s, poses, &s.volume);
  EXPECT_FALSE(finding.turn.decided);
  EXPECT_FALSE(finding.turn.reason.empty());
}

TEST(Appearance, AMissingPhotographIsNamed) {
  const test::ColouredScene& s = SharpTomato();
  PhotoSet photos = s.scene.photos;
  photos.photos[2].path = s.folder->path() / "nowhere.png";
  Poses poses = test::PosesTurnedBy(s, 0, {});
  const auto status = DecideFreeTurns(s.mesh, nullptr, photos, s.scene.masks, {}, poses);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::bad_input);
  EXPECT_NE(ToString(status.error()).find("nowhere.png"), std::string::npos);
}

}  // namespace
}  // namespace scan
