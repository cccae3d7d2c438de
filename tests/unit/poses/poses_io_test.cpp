#include <gtest/gtest.h>

#include <fstream>

#include "drivers/base/files.h"
#include "drivers/base/rng.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/poses/poses_samples.h"

namespace scan {
namespace {

std::filesystem::path Golden() {
  return std::filesystem::path(SCAN_SOURCE_DIR) / "tests/golden/poses/poses.json";
}

void ExpectSame(const SharedEstimate& a, const SharedEstimate& b) {
  EXPECT_EQ(a.value, b.value);
  EXPECT_EQ(a.sigma, b.sigma);
  EXPECT_EQ(a.prior_sigma, b.prior_sigma);
}

void ExpectSame(const ViewPose& a, const ViewPose& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.lens_state, b.lens_state);
  EXPECT_EQ(a.mounting, b.mounting);
  EXPECT_EQ(a.aim, b.aim);
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.reason, b.reason);
  EXPECT_EQ(a.camera_from_model.matrix34(), b.camera_from_model.matrix34());
  EXPECT_EQ(a.cost_px, b.cost_px);
  EXPECT_EQ(a.cost_l1_px, b.cost_l1_px);
  EXPECT_EQ(a.contour_rms_px, b.contour_rms_px);
  EXPECT_EQ(a.covariance, b.covariance);
  EXPECT_EQ(a.surface_sigma_px.median, b.surface_sigma_px.median);
  EXPECT_EQ(a.surface_sigma_px.p95, b.surface_sigma_px.p95);
  ASSERT_EQ(a.alternatives.size(), b.alternatives.size());
  for (std::size_t i = 0; i < a.alternatives.size(); ++i) {
    EXPECT_EQ(a.alternatives[i].camera_from_model.matrix34(),
              b.alternatives[i].camera_from_model.matrix34());
    EXPECT_EQ(a.alternatives[i].log_likelihood_gap, b.alternatives[i].log_likelihood_gap);
  }
}

void ExpectSame(const Poses& a, const Poses& b) {
  EXPECT_EQ(a.method, b.method);
  EXPECT_EQ(a.model, b.model);
  EXPECT_EQ(a.notes, b.notes);
  ASSERT_EQ(a.lens_states.size(), b.lens_states.size());
  for (const auto& [id, lens] : a.lens_states) {
    EXPECT_EQ(lens.intrinsics, b.lens_states.at(id).intrinsics);
    for (const auto& [name, estimate] : lens.parameters)
      ExpectSame(estimate, b.lens_states.at(id).parameters.at(name));
  }
  for (const auto& [name, estimate] : a.nuisances) ExpectSame(estimate, b.nuisances.at(name));
  ASSERT_EQ(a.mountings.size(), b.mountings.size());
  EXPECT_EQ(a.mountings[0].id, b.mountings[0].id);
  EXPECT_EQ(a.mountings[0].table_from_model.matrix34(), b.mountings[0].table_from_model.matrix34());
  ASSERT_EQ(a.axis_in_camera.size(), b.axis_in_camera.size());
  EXPECT_EQ(a.axis_in_camera.at("a0").direction, b.axis_in_camera.at("a0").direction);
  EXPECT_EQ(a.axis_in_camera.at("a0").point, b.axis_in_camera.at("a0").point);
  ASSERT_EQ(a.free_directions.size(), b.free_directions.size());
  const FreeDirection &fa = a.free_directions[0], &fb = b.free_directions[0];
  EXPECT_EQ(fa.kind, fb.kind);
  EXPECT_EQ(fa.scope, fb.scope);
  EXPECT_EQ(fa.of, fb.of);
  EXPECT_EQ(fa.axis, fb.axis);
  EXPECT_EQ(fa.point, fb.point);
  EXPECT_EQ(fa.data_sigma, fb.data_sigma);
  EXPECT_EQ(fa.held_by, fb.held_by);
  ASSERT_EQ(a.views.size(), b.views.size());
  for (std::size_t i = 0; i < a.views.size(); ++i) ExpectSame(a.views[i], b.views[i]);
}

TEST(PosesIo, WhatIsWrittenReadsBackExactly) {
  const TempFolder temp;
  const auto path = temp.path() / "poses.json";
  ASSERT_TRUE(WritePoses(path, SamplePoses()));
  const auto poses = ReadPoses(path);
  ASSERT_TRUE(poses) << ToString(poses.error());
  ExpectSame(*poses, SamplePoses());
}

TEST(PosesIo, TheGoldenFileKeepsItsBytes) {
  const auto poses = ReadPoses(Golden());
  ASSERT_TRUE(poses) << ToString(poses.error());
  const TempFolder temp;
  ASSERT_TRUE(WritePoses(temp.path() / "poses.json", *poses));
  EXPECT_EQ(ReadTextFile(temp.path() / "poses.json").value(), ReadTextFile(Golden()).value());
}

TEST(PosesIo, RefusesToWriteACovarianceThatIsNotFinite) {
  const TempFolder temp;
  Poses poses = SamplePoses();
  poses.views[1].covariance(2, 3) = std::numeric_limits<double>::quiet_NaN();
  const auto written = WritePoses(temp.path() / "poses.json", poses);
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().where.find("views[1].covariance[2][3]"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(temp.path() / "poses.json"));
}

TEST(PosesIo, DamageIsNamedByField) {
  const TempFolder temp;
  const auto path = temp.path() / "poses.json";
  const std::string good = ReadTextFile(Golden()).value();
  const auto damaged = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    std::ofstream(path) << text;
    const auto poses = ReadPoses(path);
    EXPECT_FALSE(poses) << to;
    if (poses) return std::string();
    EXPECT_EQ(poses.error().kind, ErrorKind::bad_input);
    return poses.error().where;
  };
  EXPECT_EQ(damaged("scanstation.poses/1", "scanstation.poses/9"), path.string() + ": schema");
  EXPECT_EQ(damaged("\"accepted\"", "\"maybe\""), path.string() + ": views[0].status");
  EXPECT_EQ(damaged("\"lens_state\": \"c0-a0\"", "\"lens_state\": \"c9\""),
            path.string() + ": views[0].lens_state");
  EXPECT_EQ(damaged("\"fl_x\": 47.4", "\"fl_x\": -1"), path.string() + ": intrinsics.c0-a0.fl_x");
  EXPECT_EQ(damaged("\"w\": 16", "\"w\": 1e300"), path.string() + ": intrinsics.c0-a0.w");
  EXPECT_EQ(damaged("\"covariance\": [", "\"covariance\": [[1],"),
            path.string() + ": views[0].covariance");
  EXPECT_EQ(damaged("{", "["), path.string());
  EXPECT_EQ(ReadPoses(temp.path() / "none.json").error().kind, ErrorKind::bad_input);
}

TEST(PosesIo, NoMutationCrashes) {
  const TempFolder temp;
  const auto path = temp.path() / "poses.json";
  const std::string good = ReadTextFile(Golden()).value();
  Rng rng(4);
  int refused = 0;
  for (int round = 0; round < 1500; ++round) {
    std::string text = good;
    for (std::uint64_t edits = 1 + rng.Below(3); edits > 0; --edits) {
      const std::size_t at = rng.Below(text.size());
      if (rng.Below(3) == 0)
        text.erase(at, 1 + rng.Below(40));
      else if (rng.Below(2) == 0)
        text[at] = static_cast<char>(rng.Below(256));
      else
        text.insert(at, text.substr(rng.Below(text.size()), rng.Below(30)));
    }
    std::ofstream(path, std::ios::binary) << text;
    const auto poses = ReadPoses(path);
    if (!poses) {
      ++refused;
      EXPECT_EQ(poses.error().kind, ErrorKind::bad_input);
    } else if (round % 20 == 0) {  // each write is synced to disk
      EXPECT_TRUE(WritePoses(path, *poses));
    }
  }
  EXPECT_GT(refused, 700);
}

}  // namespace
}  // namespace scan
