#include "reconstruction/pose/rig_solve.h"

#include <gtest/gtest.h>

#include "pose_scene.h"

namespace scan {
namespace {

constexpr double kPriorPx = 0.5, kOwnPx = 0.2, kDiscrepancyPx = 0.3, kSeenPx = 1;

// Evidence of the mask bias only: each view sees all of its outline kSeenPx outside, known to
// kOwnPx, at one place each.
std::vector<std::optional<CondensedEvidence>> BiasEvidence(const RigModel& rig,
                                                           const RigParameters& parameters,
                                                           std::span<const SurfacePlace> places) {
  std::vector<std::optional<CondensedEvidence>> evidence;
  for (std::size_t i = 0; i < places.size(); ++i) {
    CondensedEvidence view;
    const int index = static_cast<int>(i);
    view.state = {rig.CameraFromModelOf(parameters, index),
                  rig.IntrinsicsOf(parameters, rig.views()[i].lens), 0};
    const double weight = 1 / (kOwnPx * kOwnPx), s = kDiscrepancyPx;
    PlaceEvidence place{places[i], weight * s * s};
    place.C[9] = -weight * s;
    place.g = weight * s * kSeenPx;
    // Of the view alone: its noise and the discrepancy together.
    const double alone = 1 / (kOwnPx * kOwnPx + s * s);
    view.H(9, 9) = alone;
    view.g[9] = -alone * kSeenPx;
    view.places = {place};
    evidence.push_back(view);
  }
  return evidence;
}

struct Bias {
  double value = 0, information = 0;
};

Bias BiasFrom(std::span<const SurfacePlace> places) {
  test::SceneOptions options;
  options.w = 160;
  options.h = 120;
  options.views = 8;
  const test::Scene scene = test::MakeScene(test::BugMesh(0), {}, options);
  RigPriors priors;
  priors.mask_bias_px = kPriorPx;
  const RigModel rig(scene.photos, priors);
  RigParameters parameters = rig.Nominal();
  auto evidence = BiasEvidence(rig, parameters, places);
  evidence.resize(rig.views().size());
  const RigLayout layout(rig);
  const Eigen::MatrixXd information = RigInformation(rig, layout, evidence, parameters);
  SolveRig(rig, evidence, parameters);
  return {parameters.mask_bias_px, information(layout.mask_bias(), layout.mask_bias())};
}

// The least squares of n measurements of variance v each, after the prior.
void ExpectBias(const Bias& bias, double seen_variance) {
  const double prior = 1 / (kPriorPx * kPriorPx), seen = 1 / seen_variance;
  EXPECT_NEAR(bias.information, prior + seen, 1e-9 * seen);
  EXPECT_NEAR(bias.value, kSeenPx * seen / (prior + seen), 1e-6);
}

TEST(SolveRig, WhatViewsOfOnePlaceShareCountsOnce) {
  const SurfacePlace place{1, 2, 3, 4};
  const double own = kOwnPx * kOwnPx, shared = kDiscrepancyPx * kDiscrepancyPx;
  ExpectBias(BiasFrom(std::vector(1, place)), own + shared);
  ExpectBias(BiasFrom(std::vector(2, place)), own / 2 + shared);
  ExpectBias(BiasFrom(std::vector(8, place)), own / 8 + shared);
}

TEST(SolveRig, ViewsOfOtherPlacesCountEach) {
  const double own = kOwnPx * kOwnPx, shared = kDiscrepancyPx * kDiscrepancyPx;
  const std::vector<SurfacePlace> apart{{1, 2, 3, 4}, {1, 2, 3, 5}, {0, 2, 3, 4}};
  ExpectBias(BiasFrom(apart), (own + shared) / 3);
  const std::vector<SurfacePlace> pairs{{1, 2, 3, 4}, {1, 2, 3, 5}, {1, 2, 3, 4}, {1, 2, 3, 5}};
  ExpectBias(BiasFrom(pairs), (own / 2 + shared) / 2);
}

}  // namespace
}  // namespace scan
