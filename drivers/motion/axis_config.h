// What is fixed of one axis: units, limits, rates, homing.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "drivers/motion/on_stop.h"

namespace scan {

enum class HomingKind { endstop, index };

// Lengths in the axis' own unit (deg or mm), rates in that unit per second.
struct HomingConfig {
  HomingKind kind = HomingKind::endstop;
  int direction = -1;     // towards the switch, in the axis' own sense
  double position = 0;    // of the switch's edge
  double fast = 10;       // first approach
  double slow = 1;        // over the edge, always in the sense of `approach`; <= self_start
  double back_off = 2;    // before that; where the switch is left, it goes so deep into it
  double max_travel = 0;  // the switch must come within this
  int repeat_steps = 4;   // two slow approaches may differ by this
  friend bool operator==(const HomingConfig&, const HomingConfig&) = default;
};

struct AxisConfig {
  std::string name;
  std::string unit;
  double steps_per_unit = 1;
  int sign = 1;  // -1: positive steps move the axis in its negative sense
  std::optional<double> min, max;
  double velocity = 1;
  double acceleration = 1;
  double self_start = 1;
  double backlash = 0;
  int approach = 1;  // sense of the last approach, to targets and to the home switch
  std::int64_t settle_ns = 0;
  OnStop on_stop = OnStop::hold;
  bool self_locking = false;  // stays where it is without current
  HomingConfig homing;
  double sigma_shared = 0;  // 1 sigma of the homing, common to a reference epoch
  double sigma_view = 0;    // 1 sigma of a single move
  friend bool operator==(const AxisConfig&, const AxisConfig&) = default;
};

}  // namespace scan
