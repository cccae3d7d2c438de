// From CT and photographs to poses, on a body of revolution with three beads.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "drivers/base/units.h"
#include "pose_scene.h"
#include "reconstruction/fiducials/find_bead_images.h"
#include "reconstruction/fiducials/find_beads.h"
#include "reconstruction/masks/make_masks.h"
#include "reconstruction/pose/solve_joint.h"
#include "reconstruction/specimens/beaded.h"
#include "reconstruction/specimens/photograph.h"
#include "reconstruction/specimens/synthetic_ct.h"
#include "reconstruction/surface/surface.h"

namespace scan {
namespace {

// Eight photographs of 924 x 612 of the tomato, an exact body of revolution, on a rig with static
// errors, its surface and beads from its CT. The beads are sunk into it up to half of their radius,
// so that they hardly show in the outline.
struct BeadedTomato {
  test::Scene scene;
  TriangleMesh mesh;
  BeadFindings findings;
  std::vector<Bead> true_beads;
};

BeadedTomato MakeBeadedTomato() {
  BeadedOptions beads;
  beads.proud = -0.5;
  const std::shared_ptr<const Specimen> tomato = WithBeads(*MakeSpecimen("tomato"), beads);
  CtOptions ct;
  ct.voxel_mm = 0.2;
  const Volume volume = SynthesiseCt(*tomato, ct);
  BeadedTomato made;
  made.true_beads = BeadPlaces(**MakeSpecimen("tomato"), beads);
  made.findings.beads = FindBeads(volume, {.diameter_mm = 1.0}).value();
  made.mesh = ExtractSurface(volume).value().mesh;
  const PhotographScene photographed = MakePhotographScene(tomato, {.edge_mm = 0.2});
  made.scene =
      test::MakeScene(photographed.surface, TableFromModel(ExpSo3({0.1, -0.15, 1.3}), {1.5, -2, 1}),
                      test::MediumPhotos(8, true));
  BeadColourOptions blue;
  blue.colour = ParseBeadColour("#0060ff").value();
  for (std::size_t i = 0; i < made.scene.truth.size(); ++i) {
    const Intrinsics& in = made.scene.true_intrinsics[i];
    const cv::Mat photo = RenderPhotograph(photographed, made.scene.truth[i], in);
    const cv::Mat plate =
        RenderPhotograph(photographed, made.scene.truth[i], in, {.specimen_present = false});
    made.scene.masks[i] = MakeMask(photo, plate, {}).value();
    made.findings.images.push_back(FindBeadImages(photo, blue));
  }
  return made;
}

const BeadedTomato& Tomato() {
  static const BeadedTomato tomato = MakeBeadedTomato();
  return tomato;
}

// Largest error of the turn about the tomato's axis, over all views.
double AzimuthErrorDeg(const test::Scene& scene, const Poses& poses) {
  double largest = 0;
  for (std::size_t i = 0; i < poses.views.size(); ++i) {
    const Eigen::Quaterniond off(scene.truth[i].rotation().transpose() *
                                 poses.views[i].camera_from_model.rotation());
    const double turn = std::remainder(2 * std::atan2(off.z(), off.w()), 2 * kPi);
    largest = std::max(largest, DegFromRad(std::abs(turn)));
  }
  return largest;
}

std::string NotesOf(const Poses& poses) {
  std::string text;
  for (const std::string& note : poses.notes) text += note + "\n";
  return text;
}

// `turned_rad`: the placing is given, turned by so much about the axis; else it is searched.
Poses Solved(const BeadFindings& findings, std::optional<double> turned_rad = {}) {
  JointOptions options;
  options.bead_findings = findings;
  if (turned_rad)
    options.table_from_model["m0"] =
        Tomato().scene.table_from_model *
        Transform<frame::Model, frame::Model>(ExpSo3({0, 0, *turned_rad}), {0, 0, 0});
  return SolveJoint(Tomato().mesh, Tomato().scene.photos, Tomato().scene.masks, options).value();
}

// The tomato's round seeds are none.
TEST(Fiducials, TheCtShowsTheThreeBeadsAndNoOther) {
  ASSERT_EQ(Tomato().findings.beads.size(), 3u);
  double largest = 0;
  for (const Bead& bead : Tomato().findings.beads) {
    double nearest = 1e9;
    for (const Bead& other : Tomato().true_beads)
      nearest = std::min(nearest, (bead.centre - other.centre).norm());
    largest = std::max(largest, nearest);
  }
  RecordProperty("centre_error_mm", fmt::format("{:.4f}", largest));
  EXPECT_LT(largest, 0.03);
}

TEST(Fiducials, WithoutBeadsTheTomatosAzimuthIsFree) {
  const Poses poses = Solved({}, 1.0);
  ASSERT_EQ(poses.free_directions.size(), 1u) << NotesOf(poses);
  EXPECT_EQ(poses.free_directions[0].kind, FreeDirection::Kind::rotation);
}

TEST(Fiducials, ThreeBeadsGiveTheTomatosAzimuth) {
  ASSERT_EQ(Tomato().findings.beads.size(), 3u);
  const Poses poses = Solved(Tomato().findings);
  const double error_deg = AzimuthErrorDeg(Tomato().scene, poses);
  RecordProperty("azimuth_error_deg", fmt::format("{:.4f}", error_deg));
  RecordProperty("bead_residual_px",
                 fmt::format("{:.3f}", poses.nuisances.at("bead_residual_px").value));
  ::testing::Test::RecordProperty("notes", NotesOf(poses));
  EXPECT_LT(error_deg, 0.1) << NotesOf(poses);
  EXPECT_TRUE(poses.free_directions.empty()) << NotesOf(poses);
  for (const ViewPose& view : poses.views) {
    EXPECT_EQ(view.status, ViewStatus::accepted) << view.name << ": " << view.reason;
    // The reported uncertainty of the turn about the axis is of the order of the error.
    const Eigen::Vector3d axis = view.camera_from_model.rotation().col(2);
    const double sigma_deg =
        DegFromRad(std::sqrt(axis.dot(view.covariance.topLeftCorner<3, 3>() * axis)));
    EXPECT_LT(sigma_deg, 0.2);
    EXPECT_GT(4 * sigma_deg, error_deg);
  }
}

TEST(Fiducials, AMissingImageStrangersAndABeadThatFellOffChangeLittle) {
  BeadFindings findings = Tomato().findings;
  for (std::size_t i = 0; i < findings.images.size(); ++i)
    findings.images[i].push_back({{460.0 + 7 * static_cast<double>(i), 300}, 15, {2, 2}, false});
  findings.images[2].erase(findings.images[2].begin());
  // The CT had a fourth bead.
  Bead lost = findings.beads.back();  // the highest, seen from both rings
  lost.centre = ExpSo3({0, 0, 1.0}) * lost.centre;
  findings.beads.push_back(lost);
  const Poses poses = Solved(findings, 1.0);
  EXPECT_LT(AzimuthErrorDeg(Tomato().scene, poses), 0.15) << NotesOf(poses);
  EXPECT_TRUE(poses.free_directions.empty()) << NotesOf(poses);
  const std::string place = fmt::format("The bead at ({:.2f}, {:.2f}, {:.2f}) mm", lost.centre.x(),
                                        lost.centre.y(), lost.centre.z());
  EXPECT_NE(NotesOf(poses).find(place), std::string::npos) << NotesOf(poses);
}

TEST(Fiducials, WhatIsNoBeadLeavesTheAzimuthFree) {
  BeadFindings findings = Tomato().findings;
  for (auto& images : findings.images) images.clear();
  const Poses poses = Solved(findings, 1.0);
  EXPECT_EQ(poses.free_directions.size(), 1u) << NotesOf(poses);
}

}  // namespace
}  // namespace scan
