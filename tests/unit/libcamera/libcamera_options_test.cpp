// What the owner of a worker of libcamera says to it.
#include "firmware-host/camera_worker/libcamera_options.h"

#include <gtest/gtest.h>

namespace scan {
namespace {

TEST(LibcameraWorkerOptions, ArriveAsTheyWereSent) {
  LibcameraOptions options{"c1", 4056, 3040, {}};
  LibcameraConfig& config = options.config;
  config.camera = "imx477";
  config.role = "raw";
  config.pixel_format = "SRGGB10_CSI2P";
  config.lock_automatics = false;
  config.controls = {{"AwbEnable", "false"}, {"Sharpness", "0.0"}};
  config.latency_frames = 3;
  config.settings_frames = 4;
  config.timeout_ms = 5.5;
  config.reconnect_ms = 6;
  const auto arrived = LibcameraOptionsFrom(ToWorkerOptions(options));
  ASSERT_TRUE(arrived) << ToString(arrived.error());
  EXPECT_EQ(arrived->id, "c1");
  EXPECT_EQ(arrived->w, 4056);
  EXPECT_EQ(arrived->h, 3040);
  EXPECT_EQ(arrived->config, config);
}

TEST(LibcameraWorkerOptions, OfAnotherVersionAreRefusedAndNoTextIsTooStrange) {
  for (const char* text : {"", "{}", "[]", "{\"id\":1}", "no json"}) {
    const auto read = LibcameraOptionsFrom(text);
    ASSERT_FALSE(read) << text;
    EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
  }
  LibcameraOptions options;
  options.config.camera = "no UTF-8: \xff";
  EXPECT_TRUE(LibcameraOptionsFrom(ToWorkerOptions(options)));
}

}  // namespace
}  // namespace scan
