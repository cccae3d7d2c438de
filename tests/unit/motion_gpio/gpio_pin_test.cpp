#include <gtest/gtest.h>

#include "drivers/motion/gpio/gpio_motion_config.h"

namespace scan {
namespace {

TEST(GpioPin, MarksSayPullAndSense) {
  const struct {
    const char* text;
    GpioPin pin;
  } cases[] = {{"", {}},
               {"GPIO17", {"GPIO17", false, GpioBias::as_is}},
               {"!GPIO17", {"GPIO17", true, GpioBias::as_is}},
               {"^GPIO17", {"GPIO17", false, GpioBias::pull_up}},
               {"~17", {"17", false, GpioBias::pull_down}},
               {"^!X", {"X", true, GpioBias::pull_up}}};
  for (const auto& one : cases) {
    const auto pin = ParseGpioPin(one.text);
    ASSERT_TRUE(pin) << one.text;
    EXPECT_EQ(*pin, one.pin) << one.text;
    EXPECT_EQ(static_cast<bool>(*pin), one.text[0] != '\0');
  }
}

TEST(GpioPin, WhatIsNoLineIsRefused) {
  for (const char* text : {"!", "^", "^!", "!^A", "^^A", "!!A", "A B", " A", "A!"}) {
    const auto pin = ParseGpioPin(text);
    ASSERT_FALSE(pin) << text;
    EXPECT_EQ(pin.error().kind, ErrorKind::bad_input);
    EXPECT_FALSE(pin.error().mend.empty());
  }
}

}  // namespace
}  // namespace scan
