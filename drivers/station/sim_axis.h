// One simulated axis: motor, backlash, switches.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <vector>

#include "drivers/motion/axis_config.h"
#include "drivers/motion/sim/sim_step_port.h"
#include "drivers/station/station_config.h"

namespace scan {

// Positions in the axis' own unit. Thread contract: any thread.
class SimAxis final : public AxisPhysics {
 public:
  struct Errors {
    double backlash = 0;
    double scale_rel = 0;      // true travel per counted travel, minus 1
    double switch_offset = 0;  // true position of the home switch against the configuration's
  };
  struct Place {
    double position = 0;  // behind backlash and scale
    std::int64_t edges = 0;
    std::int64_t last_edge_ns = 0;
  };

  // `start` counts steps from the home switch.
  SimAxis(const AxisConfig& config, const Errors& errors, std::int64_t start_steps,
          std::vector<LostSteps> lost)
      : config_(config), errors_(errors), steps_(start_steps), lost_(std::move(lost)) {
    behind_play_ = MotorPosition();
  }

  void OnPower(bool on) override {
    std::lock_guard lock(mutex_);
    powered_ = on;
  }

  void OnEdge(bool positive, std::int64_t mono_ns) override {
    std::lock_guard lock(mutex_);
    if (!powered_) return;
    ++edges_;
    last_edge_ns_ = mono_ns;
    for (LostSteps& lost : lost_) {
      if (lost.count > 0 && edges_ > lost.after_steps) {
        --lost.count;
        return;
      }
    }
    steps_ += positive ? 1 : -1;
    // The side of the play that the last approach uses is the one without error.
    const double motor = MotorPosition();
    const double low = config_.approach > 0 ? motor : motor - errors_.backlash;
    const double high = config_.approach > 0 ? motor + errors_.backlash : motor;
    behind_play_ = std::clamp(behind_play_, low, high);
  }

  bool Endstop() const override {
    std::lock_guard lock(mutex_);
    return BehindSwitchEdge() > 0;
  }

  bool Index() const override {
    std::lock_guard lock(mutex_);
    double along = std::fmod(BehindSwitchEdge(), 360.0);
    if (along < 0) along += 360.0;
    return along < kIndexWidthDeg;
  }

  void Lose(std::int64_t count) {
    std::lock_guard lock(mutex_);
    lost_.push_back({"", edges_, count});
  }

  Place Now() const {
    std::lock_guard lock(mutex_);
    return {
        config_.homing.position + errors_.switch_offset + behind_play_ * (1 + errors_.scale_rel),
        edges_, last_edge_ns_};
  }

 private:
  static constexpr double kIndexWidthDeg = 2;

  // How far the axis is inside the switch. The edge lies half a step before 0 in the sense in which
  // homing goes over it, so that 0 is the first step behind it.
  double BehindSwitchEdge() const {
    return (behind_play_ + 0.5 * config_.approach / config_.steps_per_unit) *
           config_.homing.direction;
  }
  // From the home switch, before backlash and scale.
  double MotorPosition() const {
    return config_.sign * static_cast<double>(steps_) / config_.steps_per_unit;
  }

  const AxisConfig config_;
  const Errors errors_;
  mutable std::mutex mutex_;
  bool powered_ = false;
  std::int64_t steps_;
  double behind_play_ = 0;
  std::int64_t edges_ = 0;
  std::int64_t last_edge_ns_ = 0;
  std::vector<LostSteps> lost_;
};

}  // namespace scan
