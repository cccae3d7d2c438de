// Two simulated Tic boards on a simulated bus, and the motion on them.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>

#include "drivers/base/virtual_clock.h"
#include "drivers/motion/tic/sim_tic.h"
#include "drivers/motion/tic/tic_motion.h"
#include "drivers/usb/sim_usb_bus.h"

namespace scan {

// Both axes home backwards: position 0 is one step before the edge of the reverse limit switch.
struct TicBench {
  static UsbIdentity Board(const std::string& port, const std::string& serial) {
    return {kPololuVendor, 0x00b3, 0x0107, port, serial, "Tic T825", 0, 0};
  }
  static AxisConfig SmallAxis(const std::string& name, const std::string& unit) {
    AxisConfig axis;
    axis.name = name;
    axis.unit = unit;
    axis.steps_per_unit = 40;
    axis.min = 0;
    axis.max = 340;
    axis.velocity = 60;
    axis.acceleration = 240;
    axis.self_start = 5;
    axis.settle_ns = 20'000'000;
    axis.homing = {HomingKind::endstop, -1, 0, 30, 2, 3, 400};
    return axis;
  }
  explicit TicBench(std::shared_ptr<Clock> the_clock = std::make_shared<VirtualClock>())
      : clock(std::move(the_clock)) {
    parts.turntable = SmallAxis("turntable", "deg");
    parts.lift = SmallAxis("lift", "mm");
    parts.tic.turntable.serial = "T1";
    parts.tic.lift.port = "1-2.4";
    parts.aim_ids = {"a0"};
    SimTic::Options options;
    options.clock = clock;
    options.settings.reverse_limit_pins = 1;
    options.reverse_edge = 0;
    options.start = 400;
    turntable = std::make_shared<SimTic>(options);
    options.start = -20;  // stands in its switch
    lift = std::make_shared<SimTic>(options);
    bus->Plug(Board("1-2.3", "T1"), turntable);
    bus->Plug(Board("1-2.4", "L1"), lift);
  }
  std::unique_ptr<TicMotion> Make() {
    auto made = TicMotion::Make(parts, bus, clock);
    EXPECT_TRUE(made) << ToString(made.error());
    return made ? std::move(*made) : nullptr;
  }
  // True places as the axis' own units.
  static double UnitsOf(const SimTic& tic) { return static_cast<double>(tic.place() - 1) / 40; }

  std::shared_ptr<Clock> clock;
  std::shared_ptr<SimUsbBus> bus = std::make_shared<SimUsbBus>();
  std::shared_ptr<SimTic> turntable, lift;
  TicMotionParts parts;
};

}  // namespace scan
