// The motion of configs/station-lab.toml on the kernel's lines, with the motor model on their other
// side.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "drivers/io/gpio/gpiod_lines.h"
#include "drivers/motion/gpio/gpio_motion.h"
#include "drivers/motion/real_time.h"
#include "drivers/station/station_file.h"
#include "tests/lab/motor_model.h"

namespace scan {

struct LabStation {
  StationConfig config;
  LabBoard board;
  std::shared_ptr<MotorModel> motors;
  std::shared_ptr<Clock> clock = std::make_shared<RealTimeClock>();

  // Near the switches, so that homing takes a second. Precondition: in the guest.
  static LabStation Make() {
    LabStation station;
    auto config = LoadStationConfig(SCAN_SOURCE_DIR "/configs/station-lab.toml");
    EXPECT_TRUE(config) << ToString(config.error());
    station.config = config.value();
    station.board = LabBoardFromEnvironment().value();
    auto motors = MotorModel::Start(station.board, {LabTurntable(-400), LabLift(300)});
    EXPECT_TRUE(motors) << ToString(motors.error());
    station.motors = std::move(*motors);
    return station;
  }

  // Turned by hand to where Make() had them, long enough ago for the driver to have seen it.
  void TurnBack() const {
    EXPECT_TRUE(motors->Sync());
    EXPECT_TRUE(motors->Turn("turntable", -400 - motors->State("turntable").position));
    EXPECT_TRUE(motors->Turn("lift", 300 - motors->State("lift").position));
    clock->SleepFor(300'000'000);
  }

  std::unique_ptr<Motion> MakeMotion(const GpioOpener& open = OpenGpiodLines) const {
    auto motion = MakeGpioMotion({config.turntable, config.lift, config.gpio, {"a0"}}, open, clock);
    EXPECT_TRUE(motion) << ToString(motion.error());
    return motion ? std::move(*motion) : nullptr;
  }
};

}  // namespace scan
