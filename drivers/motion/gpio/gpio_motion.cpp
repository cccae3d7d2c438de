#include "drivers/motion/gpio/gpio_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/base/log.h"
#include "drivers/motion/gpio/gpio_step_port.h"
#include "drivers/motion/gpio/input_watch.h"
#include "drivers/motion/power_readback.h"
#include "drivers/motion/real_time_motion.h"
#include "drivers/motion/stepper_motion.h"

namespace scan {
namespace {

// The aims' names; whoever aims the camera does it before the move.
class NamedAims final : public AimPreset {
 public:
  explicit NamedAims(std::vector<std::string> ids) : ids_(std::move(ids)) {}
  std::vector<std::string> Ids() const override { return ids_; }
  std::string Current() const override { return current_; }
  Status GoTo(const std::string& id) override {
    current_ = id;
    return {};
  }

 private:
  std::vector<std::string> ids_;
  std::string current_ = ids_.empty() ? std::string() : ids_.front();
};

// Keeps the watch from speaking to a motion that has gone.
class WatchedMotion final : public Motion {
 public:
  WatchedMotion(std::shared_ptr<InputWatch> watch, std::unique_ptr<PowerReadback> readback,
                std::unique_ptr<Motion> inner)
      : inner_(std::move(inner)), readback_(std::move(readback)), watch_(std::move(watch)) {}
  Result<HomeReport> Home(std::stop_token stop) override { return inner_->Home(stop); }
  Result<MoveReport> MoveTo(const StageTarget& target, std::stop_token stop) override {
    return inner_->MoveTo(target, stop);
  }
  Status Stop() override { return inner_->Stop(); }
  Status Abort() override { return inner_->Abort(); }
  Status LoseHeartbeat() override { return inner_->LoseHeartbeat(); }
  Status Acknowledge() override { return inner_->Acknowledge(); }
  MotionStatus ReadStatus() override { return inner_->ReadStatus(); }
  ~WatchedMotion() override { watch_->Deafen(); }

 private:
  std::unique_ptr<Motion> inner_;
  std::unique_ptr<PowerReadback> readback_;
  std::shared_ptr<InputWatch> watch_;
};

std::string Us(std::int64_t ns) { return fmt::format("{:.1f}", static_cast<double>(ns) * 1e-3); }

void LogRecord(const MotionRecord& record) {
  const LatenessHistogram& late = record.lateness;
  Log(LogLevel::info, record.what,
      {{"outcome", record.outcome},
       {"steps", std::to_string(late.count())},
       {"late_p50_us", Us(late.QuantileNs(0.5))},
       {"late_p99_us", Us(late.QuantileNs(0.99))},
       {"late_max_us", Us(late.max_ns())},
       {"shifts", std::to_string(record.late_shifts)},
       {"shifted_us", Us(record.shifted_ns)}});
}

void LogGrant(const RealTimeGrant& grant) {
  Log(grant.mend.empty() ? LogLevel::info : LogLevel::warning, "real_time",
      {{"fifo", grant.fifo ? "yes" : "no"},
       {"memory_locked", grant.memory_locked ? "yes" : "no"},
       {"pinned", grant.pinned ? "yes" : "no"},
       {"mend", grant.mend}});
}

// The places of an axis' switches among the watched inputs.
struct Inputs {
  std::vector<InputWatch::Input> all;
  std::optional<std::size_t> Add(const std::string& name, const GpioPin& pin) {
    if (!pin) return std::nullopt;
    all.push_back({name, pin});
    return all.size() - 1;
  }
};

std::unique_ptr<StepPort> Wrapped(const StepPortWrap& wrap, const std::string& axis,
                                  std::unique_ptr<StepPort> port) {
  return wrap ? wrap(axis, std::move(port)) : std::move(port);
}

Status CheckSwitch(const AxisConfig& axis, const GpioAxisWiring& wiring) {
  const bool endstop = axis.homing.kind == HomingKind::endstop;
  if (endstop ? wiring.endstop : wiring.index) return {};
  const char* kind = endstop ? "endstop" : "index";
  return BadInput(fmt::format("homing looks for an {} that has no line", kind),
                  fmt::format("axis.{}.gpio.{}", axis.name, kind), "name the line");
}

}  // namespace

Result<std::unique_ptr<Motion>> MakeGpioMotion(const GpioMotionParts& parts, const GpioOpener& open,
                                               std::shared_ptr<Clock> clock) {
  const GpioMotionConfig& gpio = parts.gpio;
  SCAN_CHECK(CheckSwitch(parts.turntable, gpio.turntable));
  SCAN_CHECK(CheckSwitch(parts.lift, gpio.lift));
  Inputs inputs;
  const auto estop = inputs.Add("emergency stop", gpio.emergency_stop);
  const auto cover = inputs.Add("cover", gpio.cover);
  // Watched for its absence, so that a line that fails counts as a supply that is gone.
  GpioPin no_power = gpio.motor_power;
  no_power.active_low = !no_power.active_low;
  const auto power_off = inputs.Add("motor power", no_power);
  GpioStepPort::Switches turntable, lift;
  turntable.endstop = inputs.Add("turntable endstop", gpio.turntable.endstop);
  turntable.index = inputs.Add("turntable index", gpio.turntable.index);
  lift.endstop = inputs.Add("lift endstop", gpio.lift.endstop);
  lift.index = inputs.Add("lift index", gpio.lift.index);
  // News of a switch must not wait for other programs, nor keep a step from being on time.
  const int priority = gpio.real_time.priority > 0 ? std::max(1, gpio.real_time.priority - 1) : 0;
  SCAN_TRY(auto started, InputWatch::Start(open, gpio.chip, inputs.all, priority));
  const std::shared_ptr<InputWatch> watch = std::move(started);
  turntable.watch = lift.watch = watch;

  SCAN_TRY(auto turntable_port, GpioStepPort::Open(open, gpio.chip, parts.turntable.name,
                                                   gpio.turntable, turntable, clock));
  SCAN_TRY(auto lift_port,
           GpioStepPort::Open(open, gpio.chip, parts.lift.name, gpio.lift, lift, clock));
  StepperMotion::Parts motion_parts;
  motion_parts.clock = clock;
  motion_parts.turntable = std::make_unique<Axis>(
      parts.turntable, Wrapped(parts.wrap, parts.turntable.name, std::move(turntable_port)));
  motion_parts.lift = std::make_unique<Axis>(
      parts.lift, Wrapped(parts.wrap, parts.lift.name, std::move(lift_port)));
  motion_parts.aim = std::make_unique<NamedAims>(parts.aim_ids);
  motion_parts.on_end = LogRecord;
  auto motion = std::make_unique<StepperMotion>(std::move(motion_parts));
  auto readback =
      std::make_unique<PowerReadback>(std::llround(gpio.power_off_ms * 1e6), power_off.has_value(),
                                      [raw = motion.get()](bool present) {
                                        raw->SetInterlock(Interlock::motor_power_not_cut, present);
                                      });
  watch->Listen([raw = motion.get(), power = readback.get(), estop, cover, power_off](
                    std::size_t input, bool active) {
    if (input == estop) {
      raw->SetInterlock(Interlock::emergency_stop, active);
      power->OnEmergencyStop(active);
    }
    if (input == cover) raw->SetInterlock(Interlock::cover_open, active);
    if (input == power_off) {
      raw->SetInterlock(Interlock::motor_power_off, active);
      power->OnPower(!active);
    }
  });
  auto real_time = std::make_unique<RealTimeMotion>(std::move(motion), gpio.real_time, LogGrant);
  return std::make_unique<WatchedMotion>(watch, std::move(readback), std::move(real_time));
}

}  // namespace scan
