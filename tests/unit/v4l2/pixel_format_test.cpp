#include "drivers/camera/v4l2/pixel_format.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <set>

#include "tests/support/v4l2_bench.h"

namespace scan {
namespace {

OfferedFormat Offer(const char* name, std::vector<std::pair<int, int>> sizes) {
  OfferedFormat offer;
  offer.fourcc = FindPixelFormat(name)->fourcc;
  for (const auto& [w, h] : sizes) offer.sizes.push_back({w, h, {}});
  return offer;
}

const std::vector<OfferedFormat> kWebcam = {Offer("YUYV", {{640, 480}, {1280, 720}}),
                                            Offer("MJPG", {{1920, 1080}, {640, 480}, {1280, 720}}),
                                            Offer("GREY", {{1280, 720}})};

struct ChoiceCase {
  FormatWish wish;
  const char* name;
  int w, h;
};

TEST(PixelFormat, TheLargestIsChosenAndAmongEqualsWhatKeepsMost) {
  const ChoiceCase cases[] = {{{}, "MJPG", 1920, 1080},
                              {{"YUYV", 0, 0, 0}, "YUYV", 1280, 720},
                              {{"", 1280, 720, 0}, "YUYV", 1280, 720},
                              {{"GREY", 0, 0, 0}, "GREY", 1280, 720},
                              {{"MJPG", 640, 480, 0}, "MJPG", 640, 480}};
  for (const ChoiceCase& c : cases) {
    const auto choice = ChooseFormat(kWebcam, c.wish, "cam");
    ASSERT_TRUE(choice) << ToString(choice.error());
    EXPECT_STREQ(choice->format->name, c.name);
    EXPECT_EQ(choice->w, c.w);
    EXPECT_EQ(choice->h, c.h);
  }
}

TEST(PixelFormat, WhatIsNotOfferedIsRefusedWithTheOffer) {
  for (const FormatWish& wish :
       {FormatWish{"NV12", 0, 0, 0}, FormatWish{"", 800, 600, 0}, FormatWish{"H264", 0, 0, 0}}) {
    const auto choice = ChooseFormat(kWebcam, wish, "cam");
    ASSERT_FALSE(choice);
    EXPECT_EQ(choice.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(choice.error().mend, testing::HasSubstr("MJPG 1920x1080"));
  }
}

TEST(PixelFormat, BytesOfAPictureFollowTheLayout) {
  const auto bytes = [](const char* name, int w, int h, int line) {
    return PictureBytes(*FindPixelFormat(name), w, h, line);
  };
  EXPECT_EQ(bytes("YUYV", 640, 480, 0), 614400U);
  EXPECT_EQ(bytes("NV12", 640, 480, 0), 460800U);
  EXPECT_EQ(bytes("NV12", 6, 5, 8), 64U);
  EXPECT_EQ(bytes("RGB3", 10, 2, 32), 64U);
  EXPECT_EQ(bytes("RG10", 10, 2, 0), 40U);
  EXPECT_EQ(bytes("pRAA", 8, 2, 0), 20U);
  EXPECT_EQ(bytes("pRCC", 8, 2, 0), 24U);
  EXPECT_EQ(bytes("MJPG", 640, 480, 0), 0U);
  // Widths that end within a group of pixels.
  EXPECT_EQ(bytes("YUYV", 5, 2, 0), 24U);
  EXPECT_EQ(bytes("NV12", 5, 2, 0), 18U);
  EXPECT_EQ(bytes("pRAA", 5, 2, 0), 20U);
  EXPECT_EQ(bytes("pRCC", 5, 2, 0), 18U);
}

TEST(PixelFormat, NamesAreTheFourLettersOfTheKernel) {
  for (const char* name :
       {"MJPG", "YUYV", "NV12", "GREY", "RGB3", "BGR3", "RGGB", "BA81", "GRBG", "GBRG",
        "RG10", "BG10", "BA10", "GB10", "pRAA", "RG12", "RG14", "RG16", "BYR2", "Y16"}) {
    const PixelFormat* format = FindPixelFormat(name);
    ASSERT_NE(format, nullptr) << name;
    EXPECT_EQ(FourccText(format->fourcc), name);
    EXPECT_EQ(FindPixelFormat(format->fourcc), format);
  }
}

TEST(PixelFormat, ARangeOfSizesHoldsItsStepsOnly) {
  SimulatedV4l2Options options;
  options.formats = {{V4L2_PIX_FMT_RGB24, {{64, 48}}, true}};
  for (const auto& [w, h, good] : {std::tuple{0, 0, true},
                                   {32, 20, true},
                                   {33, 20, false},
                                   {66, 48, false},
                                   {14, 16, false}}) {
    V4l2CameraOptions wish;
    wish.w = w;
    wish.h = h;
    V4l2Bench bench(options, wish);
    const Status opened = bench.Open();
    EXPECT_EQ(opened.has_value(), good) << w << "x" << h;
    if (!good) {
      EXPECT_EQ(opened.error().kind, ErrorKind::bad_input);
      bench.ExpectNothingHeld();
      continue;
    }
    EXPECT_EQ(bench.camera->Info().w, w == 0 ? 64 : w);
    EXPECT_EQ(bench.camera->Info().h, h == 0 ? 48 : h);
  }
}

}  // namespace
}  // namespace scan
