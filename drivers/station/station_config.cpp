#include "drivers/station/station_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "drivers/motion/tic/tic_protocol.h"
#include "drivers/motion/tmc2209/tmc2209_motion.h"

namespace scan {
namespace {

bool IsId(std::string_view id) {
  return !id.empty() && id.size() <= 64 && std::all_of(id.begin(), id.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-';
  });
}

Status ValidateAxis(const AxisConfig& axis) {
  const auto where = [&](const char* key) { return fmt::format("axis.{}.{}", axis.name, key); };
  if (axis.min && axis.max && !(*axis.min < *axis.max)) {
    return BadInput("min is not below max", where("min"), "give min < max, or leave both out");
  }
  if (axis.self_start > axis.velocity) {
    return BadInput("self_start is above velocity", where("self_start"), "lower it");
  }
  for (const double rate : {axis.velocity, axis.acceleration, axis.self_start}) {
    if (rate * axis.steps_per_unit < 1 || rate * axis.steps_per_unit > 1e7) {
      return BadInput("a rate is outside 1 to 10000000 steps/s", where("velocity"),
                      "check velocity, acceleration, self_start and steps_per_unit");
    }
  }
  const HomingConfig& homing = axis.homing;
  if (homing.slow > axis.self_start) {
    return BadInput("the slow approach is above self_start", where("homing.slow"),
                    "the switch must stop the axis without a ramp: lower it");
  }
  if (homing.fast < homing.slow) {
    return BadInput("fast is below slow", where("homing.fast"), "raise it");
  }
  if (homing.back_off <= axis.backlash) {
    return BadInput("back_off does not leave the backlash", where("homing.back_off"),
                    "make it larger than backlash");
  }
  if (!(homing.max_travel > homing.back_off)) {
    return BadInput("max_travel is too short", where("homing.max_travel"),
                    "give the whole travel of the axis and some to spare");
  }
  const auto& limit = axis.approach > 0 ? axis.min : axis.max;
  if (homing.kind == HomingKind::endstop && limit && homing.direction != axis.approach &&
      (*limit - homing.position) * axis.approach < 2 * axis.backlash) {
    return BadInput("the limit is too near the endstop", where(axis.approach > 0 ? "min" : "max"),
                    "keep twice the backlash between them, for the approach from one side");
  }
  return {};
}

Status ValidateWiring(const AxisConfig& axis, const GpioAxisWiring& wiring) {
  const auto where = [&](const char* key) {
    return fmt::format("axis.{}.gpio.{}", axis.name, key);
  };
  if (!wiring.step) return BadInput("no step line", where("step"), "name the line");
  if (!wiring.direction) return BadInput("no direction line", where("direction"), "name the line");
  if (axis.on_stop == OnStop::brake && !wiring.brake) {
    return BadInput("on_stop is brake and no brake is wired", where("brake"),
                    "name its line, or choose another on_stop");
  }
  const bool endstop = axis.homing.kind == HomingKind::endstop;
  if (!(endstop ? wiring.endstop : wiring.index)) {
    return BadInput("homing looks for a switch that has no line",
                    where(endstop ? "endstop" : "index"), "name the line");
  }
  // The pulse and the pause after it must fit into half of the shortest step.
  const double step_us = 1e6 / (axis.velocity * axis.steps_per_unit);
  if (2 * wiring.pulse_us > 0.5 * step_us) {
    return BadInput(fmt::format("a step lasts {:.1f} us at full velocity", step_us),
                    where("pulse_us"), "shorten the pulse or lower the velocity");
  }
  return {};
}

Status ValidateTic(const AxisConfig& axis, const TicAxisWiring& wiring) {
  const auto where = [&](const char* key) { return fmt::format("axis.{}.{}", axis.name, key); };
  if (wiring.serial.empty() && wiring.port.empty()) {
    return BadInput("no board", where("tic.serial"),
                    "name its serial number or its port ('scanstation device tic list')");
  }
  if (wiring.microsteps != 0) {
    if (auto mode = TicStepMode(wiring.microsteps); !mode) {
      return BadInput(mode.error().what, where("tic.microsteps"), mode.error().mend);
    }
  }
  const double fastest = std::max(axis.velocity, axis.homing.fast) * axis.steps_per_unit;
  if (fastest > kTicMaxSpeedHz) {
    return BadInput(fmt::format("{:.0f} microsteps/s are more than a board makes ({:.0f})", fastest,
                                kTicMaxSpeedHz),
                    where("velocity"), "lower it, or use fewer microsteps");
  }
  if (axis.acceleration * axis.steps_per_unit > kTicMaxAccelHz2) {
    return BadInput("the acceleration is more than a board takes", where("acceleration"),
                    "lower it");
  }
  if (axis.homing.kind != HomingKind::endstop) {
    return BadInput("a board homes on a limit switch only", where("homing.kind"),
                    "choose endstop, and keep min and max within one turn");
  }
  if (axis.backlash > 0 && axis.approach == axis.homing.direction) {
    return BadInput("a board's homing ends away from the switch, against the last approach",
                    where("approach"), "choose the other sense, or home towards the other end");
  }
  if (axis.on_stop == OnStop::brake) {
    return BadInput("a board works no brake", where("on_stop"), "choose hold or release");
  }
  return {};
}

Status ValidateDriver(const StationConfig& config) {
  if (config.motion_driver == MotionDriver::sim) return {};
  if (config.motion_driver == MotionDriver::gpio) {
    if (config.gpio.motor_power && !config.gpio.emergency_stop) {
      return BadInput("the motors' supply is read back, but no emergency stop is wired",
                      "motion.emergency_stop", "name its line");
    }
    SCAN_CHECK(ValidateWiring(config.turntable, config.gpio.turntable));
    SCAN_CHECK(ValidateWiring(config.lift, config.gpio.lift));
    SCAN_CHECK(ValidateTmc2209s(config.turntable_tmc2209, config.lift_tmc2209));
  } else {
    SCAN_CHECK(ValidateTic(config.turntable, config.tic.turntable));
    SCAN_CHECK(ValidateTic(config.lift, config.tic.lift));
    if (config.tic.lift.serial == config.tic.turntable.serial &&
        config.tic.lift.port == config.tic.turntable.port) {
      return BadInput("both axes name the same board", "axis.lift.tic.serial", "name a board each");
    }
  }
  if (config.lift_geometry.kind == "pitch_axis" && config.aims.size() > 1) {
    return BadInput("no driver moves the camera's pitch on this station", "axis.lift.kind",
                    "choose fixed_pitch, arc or manual_aim, or keep one aim");
  }
  return {};
}

Status ValidateLight(const LightConfig& light) {
  if (light.driver == LightDriver::gpio && !light.line) {
    return BadInput("the lamp has no line", "light.line", "name it");
  }
  if (light.driver == LightDriver::gpio && light.level != 1) {
    return BadInput("a lamp on a line is on or off", "light.level",
                    "leave it out, or put the lamp on a PWM output");
  }
  if (light.driver == LightDriver::gpio && light.active_low) {
    return BadInput("the sense of a lamp on a line is not set by active_low", "light.active_low",
                    "leave it out, and write light.line = \"!NAME\"");
  }
  if (light.driver == LightDriver::pwm && light.chip.empty()) {
    return BadInput("the lamp has no PWM chip", "light.chip",
                    "name its device ('ls -l /sys/class/pwm/*/device')");
  }
  return {};
}

template <class Items>
Status ValidateIds(const Items& items, const char* key) {
  std::set<std::string> seen;
  if (items.empty()) {
    return BadInput(fmt::format("the station has no {}", key), key,
                    fmt::format("add a [[{}]] table", key));
  }
  for (const auto& item : items) {
    if (!IsId(item.id)) {
      return BadInput(fmt::format("'{}' is not an id", item.id), fmt::format("{}.id", key),
                      "use a-z, 0-9 and -");
    }
    if (!seen.insert(item.id).second) {
      return BadInput(fmt::format("id '{}' is there twice", item.id), fmt::format("{}.id", key),
                      "ids must differ");
    }
  }
  return {};
}

}  // namespace

SimErrors DefaultSimErrors(ErrorLevel level) {
  SimErrors errors;
  if (level == ErrorLevel::ideal) return errors;
  errors.focal_rel = 0.0005;
  errors.principal_point_px = 3;
  errors.runout_mm = 0.05;
  errors.axis_tilt_deg = 0.5;
  errors.backlash_deg = 0.1;
  errors.backlash_mm = 0.05;
  errors.lift_scale_rel = 0.001;
  errors.aim_rotation_deg = 0.2;
  errors.aim_translation_mm = 0.5;
  if (level == ErrorLevel::static_errors) return errors;
  errors.view_sigma_deg = 0.1;
  errors.view_sigma_mm = 0.1;
  errors.vibration_deg = 0.3;
  errors.late_frames = 1;
  return errors;
}

Result<ErrorLevel> ParseErrorLevel(std::string_view word) {
  if (word == "ideal") return ErrorLevel::ideal;
  if (word == "static") return ErrorLevel::static_errors;
  if (word == "dynamic") return ErrorLevel::dynamic;
  return BadInput(fmt::format("'{}' is no error level", word), "sim.errors.level",
                  "choose ideal, static or dynamic");
}

StationConfig DefaultSimStation() {
  StationConfig config;
  AxisConfig& turntable = config.turntable;
  turntable.name = "turntable";
  turntable.unit = "deg";
  turntable.steps_per_unit = 40;
  turntable.velocity = 30;
  turntable.acceleration = 60;
  turntable.self_start = 5;
  turntable.backlash = 0.1;
  turntable.settle_ns = 500'000'000;
  turntable.homing = {HomingKind::index, 1, 0, 20, 2, 3, 370};
  turntable.sigma_shared = 0.1;
  turntable.sigma_view = 0.05;
  AxisConfig& lift = config.lift;
  lift.name = "lift";
  lift.unit = "mm";
  lift.steps_per_unit = 400;
  lift.min = 0;
  lift.max = 200;
  lift.velocity = 20;
  lift.acceleration = 80;
  lift.self_start = 2;
  lift.backlash = 0.05;
  lift.settle_ns = 300'000'000;
  lift.homing = {HomingKind::endstop, -1, -5, 15, 1, 2, 230};
  lift.sigma_shared = 0.1;
  lift.sigma_view = 0.05;
  CameraConfig camera;
  camera.lens.k1 = -0.06;
  camera.lens.k2 = 0.08;
  config.cameras = {camera};
  config.aims = {{"a0", 15, 20, 35, 550}, {"a1", 45, 160, 35, 550}};
  config.plan.rings = {{"a0", 12, 0}, {"a1", 12, 15}};
  config.sim.errors = DefaultSimErrors(ErrorLevel::static_errors);
  return config;
}

const CameraConfig* FindCamera(const StationConfig& config, std::string_view id) {
  for (const CameraConfig& camera : config.cameras) {
    if (camera.id == id) return &camera;
  }
  return nullptr;
}

const AimConfig* FindAim(const StationConfig& config, std::string_view id) {
  for (const AimConfig& aim : config.aims) {
    if (aim.id == id) return &aim;
  }
  return nullptr;
}

Status Validate(const StationConfig& config) {
  SCAN_CHECK(ValidateAxis(config.turntable));
  SCAN_CHECK(ValidateAxis(config.lift));
  if (config.lift.on_stop == OnStop::release && !config.lift.self_locking) {
    return BadInput("the lift would fall when it is released", "axis.lift.on_stop",
                    "choose hold or brake, or set self_locking = true if its drive locks itself");
  }
  SCAN_CHECK(ValidateDriver(config));
  SCAN_CHECK(ValidateLight(config.light));
  SCAN_CHECK(ValidateIds(config.cameras, "camera"));
  SCAN_CHECK(ValidateIds(config.aims, "aim"));
  const auto& d = config.lift_geometry.direction_in_station;
  const double length = std::hypot(d[0], d[1], d[2]);
  if (!(std::abs(length - 1) < 1e-3)) {
    return BadInput(fmt::format("direction_in_station has the length {}", length),
                    "axis.lift.direction_in_station", "give a unit vector, up is [0, 0, 1]");
  }
  for (const AimConfig& aim : config.aims) {
    if ((config.lift.min && aim.lift_mm < *config.lift.min) ||
        (config.lift.max && aim.lift_mm > *config.lift.max)) {
      return BadInput(
          fmt::format("aim '{}' stands at {} mm, outside the lift's limits", aim.id, aim.lift_mm),
          "aim.lift_mm", "choose a height the lift can reach");
    }
  }
  if (config.plan.rings.empty()) {
    return BadInput("the plan has no ring", "plan.rings", "add one");
  }
  for (const RingConfig& ring : config.plan.rings) {
    if (!FindAim(config, ring.aim)) {
      return BadInput(fmt::format("a ring names the aim '{}', which does not exist", ring.aim),
                      "plan.rings.aim", "add the aim, or name another");
    }
  }
  for (const LostSteps& lost : config.sim.lost_steps) {
    if (lost.axis != "turntable" && lost.axis != "lift") {
      return BadInput(fmt::format("'{}' is no axis", lost.axis), "sim.lost_steps.axis",
                      "choose turntable or lift");
    }
  }
  return {};
}

}  // namespace scan
