#include "drivers/camera/v4l2/v4l2_controls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include "tests/support/v4l2_bench.h"

namespace scan {
namespace {

class Controls : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = OpenSelected(bench.system, {"sim-hcd.0/1.2", ""});
    ASSERT_TRUE(opened) << ToString(opened.error());
    device = std::move(*opened);
    auto listed = ListControls(*device);
    ASSERT_TRUE(listed) << ToString(listed.error());
    controls = *listed;
  }
  const V4l2Control& Named(const char* name) {
    const V4l2Control* control = FindControl(controls, std::string_view(name));
    EXPECT_NE(control, nullptr) << name;
    return *control;
  }
  V4l2Bench bench;
  std::unique_ptr<V4l2Device> device;
  std::vector<V4l2Control> controls;
};

TEST_F(Controls, AreListedByNameWithRangesAndMenus) {
  std::vector<std::string> names;
  for (const V4l2Control& control : controls) names.push_back(control.name);
  EXPECT_THAT(names, testing::UnorderedElementsAre(
                         "brightness", "contrast", "white_balance_automatic", "gain",
                         "power_line_frequency", "white_balance_temperature", "auto_exposure",
                         "exposure_time_absolute", "focus_absolute", "focus_automatic_continuous",
                         "iso_sensitivity"));
  const V4l2Control& line = Named("power_line_frequency");
  EXPECT_EQ(line.type, ControlType::menu);
  EXPECT_THAT(line.menu,
              testing::ElementsAre(ControlMenuEntry{0, "Disabled"}, ControlMenuEntry{1, "50 Hz"},
                                   ControlMenuEntry{2, "60 Hz"}));
  EXPECT_EQ(Named("auto_exposure").menu.size(), 2U);  // a menu with holes
  EXPECT_EQ(Named("iso_sensitivity").menu.back(), (ControlMenuEntry{2, "400"}));
  EXPECT_EQ(Named("brightness").min, -64);
  EXPECT_TRUE(Named("exposure_time_absolute").inactive);
  EXPECT_FALSE(Named("gain").inactive);
}

TEST_F(Controls, WhatTheDeviceMadeOfAValueIsReadBack) {
  const auto brightness = WriteControl(*device, Named("brightness"), -20);
  ASSERT_TRUE(brightness);
  EXPECT_EQ(*brightness, -20);
  const auto contrast = WriteControl(*device, Named("contrast"), 57);  // steps of 10
  ASSERT_TRUE(contrast);
  EXPECT_EQ(*contrast, 50);
}

TEST_F(Controls, ValuesOutOfRangeAreRefusedAndChangeNothing) {
  const std::pair<const char*, std::int64_t> cases[] = {
      {"brightness", 65}, {"brightness", -65}, {"auto_exposure", 2}, {"power_line_frequency", 3}};
  for (const auto& [name, value] : cases) {
    const std::int64_t before = *ReadControl(*device, Named(name));
    const auto written = WriteControl(*device, Named(name), value);
    ASSERT_FALSE(written) << name;
    EXPECT_EQ(written.error().kind, ErrorKind::bad_input);
    EXPECT_FALSE(written.error().mend.empty());
    EXPECT_EQ(*ReadControl(*device, Named(name)), before);
  }
  V4l2Control read_only = Named("brightness");
  read_only.read_only = true;
  EXPECT_FALSE(WriteControl(*device, read_only, 1));
}

TEST_F(Controls, ValuesAreReadAsNumbersWordsAndMenuEntries) {
  EXPECT_EQ(*ParseControlValue(Named("brightness"), "-7"), -7);
  EXPECT_EQ(*ParseControlValue(Named("white_balance_automatic"), "false"), 0);
  EXPECT_EQ(*ParseControlValue(Named("power_line_frequency"), "60 Hz"), 2);
  EXPECT_EQ(*ParseControlValue(Named("power_line_frequency"), "50_hz"), 1);
  EXPECT_EQ(*ParseControlValue(Named("auto_exposure"), "manual_mode"), 1);
  EXPECT_EQ(*ParseControlValue(Named("iso_sensitivity"), "400"), 2);
  for (const char* text : {"", "bright", "7x", "true"})
    EXPECT_FALSE(ParseControlValue(Named("brightness"), text)) << text;
}

TEST_F(Controls, AFailedCallIsAnErrorWithItsMeaning) {
  bench.system->fail_at = bench.system->calls + 1;
  bench.system->fail_errno = ENODEV;
  const auto written = WriteControl(*device, Named("brightness"), 1);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind, ErrorKind::device);
  EXPECT_THAT(written.error().mend, testing::HasSubstr("same port"));
  EXPECT_THAT(written.error().where, testing::HasSubstr("sim-hcd.0/1.2"));
}

TEST(ControlName, IsLowerCaseWithUnderscores) {
  EXPECT_EQ(ControlNameOf("White Balance, Automatic"), "white_balance_automatic");
  EXPECT_EQ(ControlNameOf("Zoom (Absolute) "), "zoom_absolute");
}

}  // namespace
}  // namespace scan
