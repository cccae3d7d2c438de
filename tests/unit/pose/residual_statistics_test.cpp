#include "reconstruction/pose/residual_statistics.h"

#include <gtest/gtest.h>

#include <map>

#include "drivers/base/rng.h"
#include "drivers/base/units.h"
#include "pose_scene.h"

namespace scan {
namespace {

constexpr double kPlaceMm = 3, kCorrelationPx = 15;

struct SeenBug {
  std::vector<ViewState> states;
  std::vector<std::vector<ContourMatch>> matches;  // no residuals
  std::vector<ViewResiduals> views() const {
    std::vector<ViewResiduals> views;
    for (std::size_t i = 0; i < states.size(); ++i) views.push_back({states[i], matches[i]});
    return views;
  }
};

SeenBug SeeFrom(int views) {
  const TriangleMesh mesh = test::BugMesh(2);
  const ContourMesh contour_mesh(mesh);
  SeenBug bug;
  for (int i = 0; i < views; ++i) {
    ViewState state = test::BugView();
    const CameraFromModel& pose = state.camera_from_model;
    state.camera_from_model =
        CameraFromModel(pose.rotation() * ExpSo3({0, 0, 2 * kPi * i / views}), pose.translation());
    std::vector<ContourMatch> matches;
    for (const ContourSample& s :
         FindContourSamples(contour_mesh, state.camera_from_model, state.intrinsics, 2))
      matches.push_back({s.point, s.pixel, s.normal, 0, s.length_px, s.vertices, 0, s.length_px});
    bug.states.push_back(state);
    bug.matches.push_back(std::move(matches));
  }
  return bug;
}

// Residuals of one standard deviation, of which `share` of the variance is the place's.
double ShareFound(double share, std::uint64_t seed) {
  SeenBug bug = SeeFrom(24);
  std::map<SurfacePlace, double> of_place;
  Rng rng(seed);
  for (std::size_t i = 0; i < bug.states.size(); ++i) {
    std::map<SurfacePlace, double> own;
    for (ContourMatch& match : bug.matches[i]) {
      const SurfacePlace place = PlaceOf(bug.states[i], match, kPlaceMm);
      if (const auto [at, added] = of_place.try_emplace(place, 0); added) at->second = rng.Normal();
      if (const auto [at, added] = own.try_emplace(place, 0); added) at->second = rng.Normal();
      match.residual_px = std::sqrt(share) * of_place[place] + std::sqrt(1 - share) * own[place];
    }
  }
  return CorrelationBetweenViews(bug.views(), kPlaceMm, kCorrelationPx);
}

TEST(CorrelationBetweenViews, IsTheShareThatViewsOfAPlaceHaveInCommon) {
  for (const double share : {0.3, 0.6, 1.0}) {
    double mean = 0;
    for (std::uint64_t seed = 0; seed < 8; ++seed) mean += ShareFound(share, seed) / 8;
    EXPECT_NEAR(mean, share, 0.06) << share;
  }
}

TEST(CorrelationBetweenViews, IsNothingForNoiseOfEachViewsOwn) {
  int nothing = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed) nothing += ShareFound(0, seed) == 0;
  EXPECT_GE(nothing, 9);
}

TEST(CorrelationBetweenViews, OfOneViewOrNoneIsNothing) {
  SeenBug bug = SeeFrom(1);
  for (ContourMatch& match : bug.matches[0]) match.residual_px = 1;
  EXPECT_EQ(CorrelationBetweenViews(bug.views(), kPlaceMm, kCorrelationPx), 0);
  EXPECT_EQ(CorrelationBetweenViews({}, kPlaceMm, kCorrelationPx), 0);
}

TEST(PlaceOf, TellsTheTwoSidesOfAThinLegApart) {
  ViewState state = test::BugView();
  state.camera_from_model = CameraFromModel(Eigen::Matrix3d::Identity(), {0, 0, 550});
  ContourMatch left, right;
  left.point = {1.4, 1.5, 1.5};
  left.normal = {-1, 0};
  right.point = {1.6, 1.5, 1.5};
  right.normal = {1, 0};
  EXPECT_NE(PlaceOf(state, left, 3), PlaceOf(state, right, 3));
  left.normal = {1, 0};
  EXPECT_EQ(PlaceOf(state, left, 3), PlaceOf(state, right, 3));
}

}  // namespace
}  // namespace scan
