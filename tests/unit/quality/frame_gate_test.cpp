#include "acquisition/quality/frame_gate.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "acquisition/quality/picture_check.h"

namespace scan {
namespace {

EncodedFile SomePicture(const std::string& extension, int w, int h, int seed) {
  cv::Mat picture(h, w, CV_8UC3);
  cv::RNG rng(static_cast<std::uint64_t>(seed));
  rng.fill(picture, cv::RNG::UNIFORM, 0, 255);
  std::vector<unsigned char> bytes;
  cv::imencode("." + extension, picture, bytes);
  EncodedFile file{extension, {}};
  for (const unsigned char b : bytes) file.bytes.push_back(std::byte{b});
  return file;
}

Frame SomeFrame() {
  Frame frame;
  frame.files = {SomePicture("png", 40, 30, 1)};
  frame.sensor_sequence = 7;
  frame.exposure = {2'000'000, 3'000'000, ExposureSource::sensor};
  frame.applied = {1000.0, std::nullopt};
  return frame;
}

FrameDemand SomeDemand() {
  FrameDemand demand;
  demand.settled_mono_ns = 2'000'000;
  demand.asked = {1000.0, 2.0};
  demand.w = 40;
  demand.h = 30;
  return demand;
}

std::optional<RejectCause> CauseOf(const Frame& frame, const FrameDemand& demand) {
  const auto rejection = FindRejection(frame, IdentityOf(frame), demand);
  if (!rejection) return std::nullopt;
  EXPECT_FALSE(rejection->text.empty());
  return rejection->cause;
}

TEST(FrameGate, AcceptsAFrameThatBeganWhenTheAxesSettled) {
  EXPECT_EQ(CauseOf(SomeFrame(), SomeDemand()), std::nullopt);
}

TEST(FrameGate, RejectsAnExposureOneNanosecondEarly) {
  Frame frame = SomeFrame();
  frame.exposure.not_before_ns -= 1;
  EXPECT_EQ(CauseOf(frame, SomeDemand()), RejectCause::before_settled);
}

TEST(FrameGate, RejectsOtherSettingsOnlyWhereTheDeviceReportsThem) {
  Frame frame = SomeFrame();
  frame.applied.exposure_us = 1009;  // rounded to whole lines
  EXPECT_EQ(CauseOf(frame, SomeDemand()), std::nullopt);
  frame.applied.exposure_us = 2000;
  EXPECT_EQ(CauseOf(frame, SomeDemand()), RejectCause::settings);
  frame.applied.exposure_us.reset();
  EXPECT_EQ(CauseOf(frame, SomeDemand()), std::nullopt);
  frame.applied.gain = 4;
  EXPECT_EQ(CauseOf(frame, SomeDemand()), RejectCause::settings);
}

TEST(FrameGate, RejectsAFrameDeliveredTwice) {
  const Frame frame = SomeFrame();
  FrameDemand demand = SomeDemand();
  demand.last = IdentityOf(frame);
  EXPECT_EQ(CauseOf(frame, demand), RejectCause::duplicate);
  demand.last->sensor_sequence = 6;  // same bytes under a new number
  EXPECT_EQ(CauseOf(frame, demand), RejectCause::duplicate);
  demand.last->sha256 = {std::string(64, '0')};
  EXPECT_EQ(CauseOf(frame, demand), std::nullopt);
}

TEST(FrameGate, RejectsMissingAndWronglySizedPictures) {
  Frame frame = SomeFrame();
  frame.files = {SomePicture("png", 30, 40, 1)};
  EXPECT_EQ(CauseOf(frame, SomeDemand()), RejectCause::wrong_size);
  frame.files.clear();
  EXPECT_EQ(CauseOf(frame, SomeDemand()), RejectCause::no_picture);
}

TEST(FrameGate, EveryCutOfAPictureIsFound) {
  for (const char* extension : {"png", "jpg"}) {
    const EncodedFile whole = SomePicture(extension, 40, 30, 3);
    std::optional<PictureSize> size;
    ASSERT_EQ(FindPictureFault(extension, whole.bytes, size), std::nullopt);
    EXPECT_EQ(size, (PictureSize{40, 30}));
    for (std::size_t n = 0; n + 12 < whole.bytes.size(); n += 37)
      EXPECT_TRUE(FindPictureFault(extension, std::span(whole.bytes).first(n), size))
          << extension << " cut at " << n;
  }
}

TEST(FrameGate, GarbageAndUnknownFormatsAreFound) {
  const std::vector<std::byte> garbage(1000, std::byte{0x5a});
  std::optional<PictureSize> size;
  for (const char* extension : {"png", "jpg", "tif", "dng", "nef", "gif"})
    EXPECT_TRUE(FindPictureFault(extension, garbage, size)) << extension;
  std::vector<std::byte> raw(1000, std::byte{0});
  raw[0] = raw[1] = std::byte{'I'};
  raw[2] = std::byte{42};
  EXPECT_FALSE(FindPictureFault("nef", raw, size));
  EXPECT_EQ(size, std::nullopt);
}

}  // namespace
}  // namespace scan
