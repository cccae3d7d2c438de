#include "reconstruction/pose/bead_evidence.h"

#include <ceres/gradient_checker.h>
#include <ceres/sized_cost_function.h>
#include <gtest/gtest.h>

#include "drivers/base/units.h"
#include "pose_scene.h"
#include "reconstruction/pose/bead_solve.h"
#include "reconstruction/pose/lens_distortion.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

const BeadSighting& Sighting() {
  static const BeadSighting sighting{0, {8, -5, 6}, 4, {900, 640}, 0.2};
  return sighting;
}

// Residual of a bead by the evidence's parameters.
class BeadCost final : public ceres::SizedCostFunction<2, kEvidenceSize> {
 public:
  BeadCost() {
    state_.camera_from_model =
        CameraFromModel(ExpSo3({0.3, -1.1, 0.7}), Eigen::Vector3d(4, -7, 120));
    state_.intrinsics = {1848, 1224, 5480, 5470, 930, 600, 0.05, -0.02, 0.001, -0.002, 0.01};
    pivot_ = state_.camera_from_model * Eigen::Vector3d(1, 2, 3);
  }
  bool Evaluate(double const* const* y, double* residuals, double** jacobians) const override {
    const Eigen::Map<const EvidenceVector> v(y[0]);
    ViewState state = state_;
    state.camera_from_model = MovedAbout(state.camera_from_model, Vector6d(v.head<6>()), pivot_);
    state.intrinsics.fl_x *= std::exp(v[6]);
    state.intrinsics.fl_y *= std::exp(v[6]);
    state.intrinsics.cx += v[7];
    state.intrinsics.cy += v[8];
    state.mask_bias_px += v[9];
    state.intrinsics.k1 += v[10] * K1OfCorner(state_.intrinsics);
    BeadDerivative dr;
    // The derivative is by a motion from here, which at y = 0 is y itself.
    Eigen::Map<Eigen::Vector2d>(residuals, 2) = BeadResidual(state, Sighting(), pivot_, &dr);
    if (jacobians && jacobians[0]) {
      Eigen::Map<Eigen::Matrix<double, 2, kEvidenceSize, Eigen::RowMajor>> dr_dy(jacobians[0]);
      dr_dy = dr;
    }
    return true;
  }

 private:
  ViewState state_;
  Eigen::Vector3d pivot_;
};

TEST(BeadResidual, DerivativePassesTheGradientChecker) {
  const BeadCost cost;
  ceres::NumericDiffOptions differences;
  differences.ridders_relative_initial_step_size = 1e-3;
  const ceres::GradientChecker checker(
      &cost, static_cast<std::vector<const ceres::Manifold*>*>(nullptr), differences);
  const EvidenceVector zero = EvidenceVector::Zero();
  const double* blocks[] = {zero.data()};
  ceres::GradientChecker::ProbeResults results;
  EXPECT_TRUE(checker.Probe(blocks, 1e-5, &results)) << results.error_log;
}

// The middle of the ellipse that rays along the ball's edge draw.
TEST(BeadPixel, IsTheMiddleOfTheBallsImage) {
  ViewState state;
  state.camera_from_model = CameraFromModel(Eigen::Matrix3d::Identity(), {0, 0, 100});
  state.intrinsics = {1848, 1224, 5000, 5000, 924, 612, 0, 0, 0, 0, 0};
  const Eigen::Vector3d centre(12, 0, 0);
  const double radius = 4, distance = std::hypot(12.0, 100.0);
  const double to_centre = std::atan2(12.0, 100.0), half = std::asin(radius / distance);
  const double low = 924 + 5000 * std::tan(to_centre - half);
  const double high = 924 + 5000 * std::tan(to_centre + half);
  EXPECT_NEAR(BeadPixel(state, centre, radius).x(), 0.5 * (low + high), 1e-9);
  EXPECT_GT(std::abs(924 + 5000 * 0.12 - 0.5 * (low + high)),
            0.5);  // the centre's own image is off
}

// The pear and beads that stand half out of it.
struct BeadedPear {
  TriangleMesh mesh = test::RevolutionMesh(60, Eigen::Vector3d::UnitZ());
  std::vector<Bead> beads;
  std::vector<ViewState> states;
  std::vector<std::vector<BeadImage>> images;
};

BeadedPear MakePear(std::vector<double> longitudes) {
  BeadedPear pear;
  const MeshBvh bvh(pear.mesh);
  double z = -4;
  for (const double longitude : longitudes) {
    const Eigen::Vector3d out(std::cos(longitude), std::sin(longitude), 0);
    const Eigen::Vector3d from(30 * out.x(), 30 * out.y(), z);
    pear.beads.push_back({from - bvh.FirstHit(from, -out)->distance_mm * out, 0.5, 0.005, 0.01});
    z += 4;
  }
  const BeadScene scene(pear.mesh, pear.beads);
  for (int view = 0; view < 6; ++view) {
    ViewState state = test::BugView();
    state.camera_from_model =
        CameraFromModel(ExpSo3({0.5 * kPi + 0.3, 0, 0}) * ExpSo3({0, 0, view * kPi / 3}),
                        Eigen::Vector3d(0, 0, 550));
    std::vector<BeadImage> images;
    for (std::size_t b = 0; b < pear.beads.size(); ++b) {
      const auto seen = scene.Appearance(b, state, 15);
      if (seen && seen->share > 0.2)
        images.push_back({seen->centroid, seen->area_px(), {2, 2}, false});
    }
    pear.images.push_back(images);
    pear.states.push_back(state);
  }
  return pear;
}

std::vector<BeadView> ViewsOf(const BeadedPear& pear, double turned_rad) {
  std::vector<BeadView> views;
  for (std::size_t i = 0; i < pear.states.size(); ++i) {
    ViewState state = pear.states[i];
    state.camera_from_model =
        CameraFromModel(state.camera_from_model.rotation() * ExpSo3({0, 0, turned_rad}),
                        state.camera_from_model.translation());
    views.push_back({state, pear.images[i]});
  }
  return views;
}

TEST(ScoreTurns, FindsHowFarTheSpecimenIsTurned) {
  const BeadedPear pear = MakePear({0.3, 2.2, 4.5});
  const BeadScene scene(pear.mesh, pear.beads);
  for (const double turned : {0.0, 1.1, -2.5}) {
    const auto turns = ScoreTurns(scene, ViewsOf(pear, turned),
                                  {Eigen::Vector3d::UnitZ(), Eigen::Vector3d::Zero()}, {});
    ASSERT_TRUE(turns);
    EXPECT_LT(std::abs(std::remainder(turns->best_rad + turned, 2 * kPi)), 0.03) << turned;
    EXPECT_LT(turns->second, 0.6 * turns->best);
    if (turned == 0.0) {
      EXPECT_NEAR(turns->as_is, turns->best, 0.1);
    }
  }
}

TEST(ScoreTurns, ASymmetricArrangementHasASecondTurn) {
  BeadedPear pear = MakePear({0.3});
  // Two more of the first, a third of a turn on each.
  for (int k = 1; k < 3; ++k) {
    Bead bead = pear.beads[0];
    bead.centre = ExpSo3({0, 0, 2 * kPi * k / 3}) * bead.centre;
    pear.beads.push_back(bead);
  }
  const BeadScene scene(pear.mesh, pear.beads);
  for (std::size_t i = 0; i < pear.states.size(); ++i) {
    pear.images[i].clear();
    for (std::size_t b = 0; b < 3; ++b)
      if (const auto seen = scene.Appearance(b, pear.states[i], 15); seen && seen->share > 0.2)
        pear.images[i].push_back({seen->centroid, seen->area_px(), {2, 2}, false});
  }
  const auto turns =
      ScoreTurns(scene, ViewsOf(pear, 0), {Eigen::Vector3d::UnitZ(), Eigen::Vector3d::Zero()}, {});
  ASSERT_TRUE(turns);
  EXPECT_GT(turns->second, 0.9 * turns->best);
}

TEST(MatchBeads, WhatIsHiddenIsNotExpectedAndStrangersStayAside) {
  BeadedPear pear = MakePear({0.3, 2.2, 4.5});
  const BeadScene scene(pear.mesh, pear.beads);
  const std::vector<bool> none(3, false);
  std::size_t sightings = 0;
  for (std::size_t i = 0; i < pear.states.size(); ++i) {
    auto images = pear.images[i];
    for (BeadImage& image : images) image.centre += Eigen::Vector2d(0.4, -0.3);
    images.push_back({{100, 80}, 20, {2, 2}, false});
    images.push_back({{920, 80}, 20, {2, 2}, true});  // cut by the border
    const BeadMatches matches = MatchBeads(scene, images, pear.states[i], none, {});
    EXPECT_LE(matches.expected.size(), matches.sightings.size());
    EXPECT_EQ(matches.strangers, 1u);
    for (const BeadSighting& s : matches.sightings) {
      const Eigen::Vector2d off = BeadResidual(pear.states[i], s, Eigen::Vector3d::Zero(), nullptr);
      EXPECT_LT((off - Eigen::Vector2d(0.4, -0.3)).norm(), 1e-6);
    }
    sightings += matches.sightings.size();
  }
  EXPECT_GE(sightings, 7u);
}

TEST(MatchBeads, ABeadLeftOutOrOfAnotherSizeIsNotTaken) {
  BeadedPear pear = MakePear({0.3, 2.2, 4.5});
  const BeadScene scene(pear.mesh, pear.beads);
  for (std::size_t i = 0; i < pear.states.size(); ++i) {
    for (const BeadSighting& s :
         MatchBeads(scene, pear.images[i], pear.states[i], {false, true, false}, {}).sightings)
      EXPECT_NE(s.bead, 1);
    for (BeadImage& image : pear.images[i]) image.area_px *= 4;
    EXPECT_TRUE(MatchBeads(scene, pear.images[i], pear.states[i], {false, false, false}, {})
                    .sightings.empty());
  }
}

}  // namespace
}  // namespace scan
