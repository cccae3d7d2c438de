#include "acquisition/session/session_writer.h"

#include <gtest/gtest.h>

#include "acquisition/session/photo_set.h"
#include "drivers/base/files.h"
#include "drivers/base/units.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/session/session_samples.h"

namespace scan {
namespace {

TEST(SessionWriter, WhatIsWrittenReadsBack) {
  const TempFolder temp;
  const auto folder = temp.path() / "session";
  ASSERT_TRUE(IsOk(WriteSampleSession(folder)));
  const auto session = ReadSession(folder);
  ASSERT_TRUE(IsOk(session));
  EXPECT_EQ(SerialiseSessionDocument(session->document).value(),
            SerialiseSessionDocument(SampleDocument()).value());
  ASSERT_EQ(session->log.size(), 6u);
  EXPECT_TRUE(std::holds_alternative<StartEntry>(session->log[0].payload));
  EXPECT_EQ(session->log[3].time, Time(3));
  ASSERT_NE(session->state.Frame("v001", 0), nullptr);
  EXPECT_EQ(session->state.Frame("v001", 0)->files.at(0).path, "frames/v001_c0.png");
  EXPECT_EQ(session->torn_bytes, 0u);
}

TEST(SessionWriter, RefusesAFolderThatIsNotEmpty) {
  const TempFolder temp;
  WriteText(temp.path() / "thesis.txt", "mine");
  const auto writer = CreateSession(temp.path(), SampleDocument(), Time(0));
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().kind, ErrorKind::bad_input);
}

TEST(SessionWriter, RefusesASecondFrameOfAViewWithoutARetake) {
  const TempFolder temp;
  const auto folder = temp.path() / "session";
  auto writer = CreateSession(folder, SampleDocument(), Time(0));
  ASSERT_TRUE(IsOk(writer));
  const FrameEntry frame = SampleFrame(SampleDocument().views[0]);
  const std::vector<EncodedFile> first = {{"png", SamplePng(16, 12, 1)}};
  const std::vector<EncodedFile> second = {{"png", SamplePng(16, 12, 2)}};
  const auto seq = writer->AppendFrame(frame, first, Time(1));
  ASSERT_TRUE(IsOk(seq));
  EXPECT_FALSE(writer->AppendFrame(frame, second, Time(2)));
  ASSERT_TRUE(IsOk(writer->Append(RetakeEntry{*seq, "v000", "c0", 0, "a hair"}, Time(3))));
  EXPECT_EQ(writer->state().Frame("v000", 0), nullptr);
  ASSERT_TRUE(IsOk(writer->AppendFrame(frame, second, Time(4))));
  // Nothing is overwritten: both pictures are there.
  EXPECT_EQ(ReadBinaryFile(folder / "frames/v000_c0.png").value(), first[0].bytes);
  EXPECT_EQ(ReadBinaryFile(folder / "frames/v000_c0_r1.png").value(), second[0].bytes);
  const auto set = LoadPhotoSet(folder);
  ASSERT_TRUE(IsOk(set));
  EXPECT_EQ(set->photos.at(0).path.filename(), "v000_c0_r1.png");
  EXPECT_GT(set->photos.at(0).capture_seq, *seq);  // when it was retaken
}

TEST(SessionWriter, TwoWritersOfOneSessionAreRefused) {
  const TempFolder temp;
  const auto folder = temp.path() / "session";
  auto writer = CreateSession(folder, SampleDocument(), Time(0));
  ASSERT_TRUE(IsOk(writer));
  const auto other = ResumeSession(folder, Time(1));
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().kind, ErrorKind::failed);
}

TEST(PhotoSet, CarriesPosesPriorsAndPlates) {
  const TempFolder temp;
  const auto folder = temp.path() / "session";
  ASSERT_TRUE(IsOk(WriteSampleSession(folder)));
  const auto set = LoadPhotoSet(folder);
  ASSERT_TRUE(IsOk(set));
  ASSERT_EQ(set->photos.size(), 2u);
  ASSERT_EQ(set->aims.size(), 2u);
  EXPECT_EQ(set->aims[0].id, "a0");
  EXPECT_EQ(set->lens_states[0].id, "c0-a0");
  EXPECT_DOUBLE_EQ(set->lens_states[0].sigma.c_px, 0.003 * 16);
  EXPECT_EQ(set->aims[0].background_plate, folder / "plates/background_a0_c0.png");
  EXPECT_TRUE(set->aims[1].background_plate.empty());
  EXPECT_DOUBLE_EQ(set->aims[0].sigma.rotation_rad, RadFromDeg(0.5));
  const Photo& photo = set->photos[1];
  EXPECT_DOUBLE_EQ(photo.turntable_rad->nominal, RadFromDeg(15.01));
  EXPECT_DOUBLE_EQ(photo.lift_mm->sigma_shared, 0.2);
  // camera_from_lift . lift_from_station . station_from_table, by hand: a lift of 120.5 mm moves
  // the table down in the camera, which is +y.
  ASSERT_TRUE(photo.camera_from_table);
  const Eigen::Vector3d origin = *photo.camera_from_table * Eigen::Vector3d::Zero();
  EXPECT_TRUE(origin.isApprox(Eigen::Vector3d(0, 7 + 120.5, 550.125), 1e-12));
  const double angle = RadFromDeg(15.01);
  const Eigen::Vector3d x_axis = photo.camera_from_table->rotation() * Eigen::Vector3d::UnitX();
  EXPECT_TRUE(x_axis.isApprox(Eigen::Vector3d(std::sin(angle), 0, -std::cos(angle)), 1e-12));
}

TEST(PhotoSet, RefusesAPictureOfAnotherSize) {
  const TempFolder temp;
  const auto folder = temp.path() / "session";
  ASSERT_TRUE(IsOk(WriteSampleSession(folder)));
  ASSERT_TRUE(IsOk(WriteFileDurably(folder / "frames/v001_c0.png", SamplePng(17, 12, 1))));
  const auto set = LoadPhotoSet(folder);
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().kind, ErrorKind::bad_input);
  EXPECT_NE(set.error().where.find("v001_c0.png"), std::string::npos);
}

}  // namespace
}  // namespace scan
