// What the contract of GPIO lines needs of a twin: lines, and the world on their other side.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <ostream>
#include <string>

#include "drivers/io/gpio/gpio_lines.h"

namespace scan {

// A board labelled `chip` with free lines OUT_A, OUT_B and IN_A, IN_B, whatever their real names.
struct GpioTwin {
  std::string chip;
  std::string out_a, out_b, in_a, in_b;
  unsigned out_a_number = 0;
  GpioOpener open;
  std::function<bool(const std::string& line)> level;  // electrical, from outside
  std::function<void(const std::string& line, bool high)> drive;
  std::function<std::int64_t()> now_ns;  // of the scale of the edges' time stamps
  std::shared_ptr<void> world;
};

struct GpioTwinFactory {
  std::string name;
  std::function<GpioTwin()> make;
  friend std::ostream& operator<<(std::ostream& out, const GpioTwinFactory& factory) {
    return out << factory.name;
  }
};

class GpioContract : public ::testing::TestWithParam<GpioTwinFactory> {
 protected:
  void SetUp() override { twin = GetParam().make(); }
  std::unique_ptr<GpioLines> MustOpen(std::vector<GpioLineConfig> lines) {
    auto opened = twin.open({twin.chip, "contract", std::move(lines)});
    EXPECT_TRUE(opened) << ToString(opened.error());
    return opened ? std::move(*opened) : nullptr;
  }
  GpioTwin twin;
};

}  // namespace scan
