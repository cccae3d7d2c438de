#include "drivers/motion/tmc2209/tmc2209_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <vector>

#include "drivers/base/log.h"
#include "drivers/motion/tmc2209/tmc2209_bus.h"

namespace scan {
namespace {

using StepCount = std::shared_ptr<std::atomic<std::int64_t>>;

// Counts the steps that were sent, up minus down.
class CountedStepPort final : public StepPort {
 public:
  CountedStepPort(std::unique_ptr<StepPort> inner, StepCount count)
      : inner_(std::move(inner)), count_(std::move(count)) {}
  Status Enable(bool on) override { return inner_->Enable(on); }
  Status Brake(bool on) override { return inner_->Brake(on); }
  Status SetDirection(bool positive) override {
    positive_ = positive;
    return inner_->SetDirection(positive);
  }
  Status EmitEdge(std::int64_t deadline_ns) override {
    SCAN_CHECK(inner_->EmitEdge(deadline_ns));
    count_->fetch_add(positive_ ? 1 : -1, std::memory_order_relaxed);
    return {};
  }
  Result<bool> Endstop() override { return inner_->Endstop(); }
  Result<bool> Index() override { return inner_->Index(); }

 private:
  std::unique_ptr<StepPort> inner_;
  StepCount count_;
  bool positive_ = true;
};

struct Driven {
  std::string axis;
  Tmc2209Config config;
  std::shared_ptr<Tmc2209Bus> bus;
  StepCount sent = std::make_shared<std::atomic<std::int64_t>>(0);
  std::int64_t sent_before = 0, mscnt_before = 0;  // when they were last compared
  int sense = 0;                                   // of MSCNT with positive steps; 0: not yet known
};

std::int64_t Modulo(std::int64_t counts) {
  return ((counts % kTmcCounts) + kTmcCounts) % kTmcCounts;
}

// Of the counter against the steps sent since the last comparison.
Status Compare(Driven& driven, std::int64_t mscnt) {
  const std::int64_t sent = *driven.sent - driven.sent_before;
  const std::int64_t counts = sent * (256 / driven.config.microsteps);
  const std::int64_t counted = Modulo(mscnt - driven.mscnt_before);
  driven.sent_before += sent;
  driven.mscnt_before = mscnt;
  const bool forward = counted == Modulo(counts), backward = counted == Modulo(-counts);
  if (driven.sense == 0 && forward != backward) driven.sense = forward ? 1 : -1;
  if (driven.sense >= 0 ? forward : backward) return {};
  return DeviceFault(
      fmt::format("its driver's microstep counter advanced by {} instead of {} of 1024 with {} "
                  "steps: pulses were lost, or noise made some",
                  counted, Modulo(driven.sense < 0 ? -counts : counts), sent),
      driven.axis, "check the step and direction wires, then home the stage");
}

Status SetUp(Driven& driven) {
  SCAN_CHECK(SetUpTmc2209(*driven.bus, driven.config));
  SCAN_TRY(const Tmc2209State state, ReadTmc2209(*driven.bus, driven.config.address));
  driven.sent_before = *driven.sent;
  driven.mscnt_before = state.mscnt;
  return {};
}

class Tmc2209Motion final : public Motion {
 public:
  Tmc2209Motion(std::vector<Driven> drivers, std::unique_ptr<Motion> inner)
      : drivers_(std::move(drivers)), inner_(std::move(inner)) {}

  Result<HomeReport> Home(std::stop_token stop) override {
    if (stop.stop_requested()) return Cancelled("homing");
    // A set-up forgets what the drivers had to tell: a homing that an interlock then refuses must
    // not leave a position behind that nobody has compared.
    SCAN_CHECK(inner_->Abort());
    for (Driven& driven : drivers_) {
      SCAN_CHECK(Noted(SetUp(driven)));
      SCAN_CHECK(Noted(ShowStalls(*driven.bus, driven.config, true)));
    }
    auto homed = inner_->Home(stop);
    for (Driven& driven : drivers_) {
      if (const Status hidden = ShowStalls(*driven.bus, driven.config, false); homed && !hidden) {
        homed = tl::unexpected(Noted(hidden).error());
      }
    }
    return Checked(std::move(homed));
  }
  Result<MoveReport> MoveTo(const StageTarget& target, std::stop_token stop) override {
    {
      const std::lock_guard lock(mutex_);
      if (fault_) return tl::unexpected(*fault_);
    }
    return Checked(inner_->MoveTo(target, stop));
  }
  Status Stop() override { return inner_->Stop(); }
  Status Abort() override { return inner_->Abort(); }
  Status LoseHeartbeat() override { return inner_->LoseHeartbeat(); }
  Status Acknowledge() override { return inner_->Acknowledge(); }
  MotionStatus ReadStatus() override {
    MotionStatus status = inner_->ReadStatus();
    const std::lock_guard lock(mutex_);
    if (fault_) {
      status.fault = fmt::format("{}: {}", fault_->where, fault_->what);
      status.alarm = Alarm::invalid;
    }
    if (!warnings_.empty()) {
      status.alarm = std::max(status.alarm, Alarm::minor);
      status.interlocks += (status.interlocks.empty() ? "" : ", ") + warnings_;
    }
    return status;
  }

 private:
  // A fault of a driver stays up until a homing has gone well.
  Status Noted(Status status) {
    if (status) return status;
    Log(LogLevel::error, "tmc2209", {{"error", ToString(status.error())}});
    (void)inner_->Abort();
    const std::lock_guard lock(mutex_);
    fault_ = status.error();
    return status;
  }

  // What the drivers say after a motion. One that ended by a fault of its own keeps that: the
  // drivers may be without supply.
  template <class Report>
  Result<Report> Checked(Result<Report> report) {
    if (!report && report.error().kind != ErrorKind::cancelled) return report;
    std::string warnings;
    for (Driven& driven : drivers_) {
      if (const Status good = Noted(Check(driven, warnings)); !good) {
        return tl::unexpected(good.error());
      }
    }
    const std::lock_guard lock(mutex_);
    if (warnings != warnings_ && !warnings.empty()) {
      Log(LogLevel::warning, "tmc2209", {{"warning", warnings}});
    }
    warnings_ = warnings;
    if constexpr (std::is_same_v<Report, HomeReport>) {
      if (report) fault_.reset();
    }
    return report;
  }

  static Status Check(Driven& driven, std::string& warnings) {
    SCAN_TRY(const Tmc2209State state, ReadTmc2209(*driven.bus, driven.config.address));
    if (const std::string words = TmcFaultWords(state.flags); !words.empty()) {
      return DeviceFault("its driver reports: " + words, driven.axis,
                         "check supply, wires, cooling and run_ma, then home the stage");
    }
    const auto warn = [&](bool up, const char* what) {
      if (up) warnings += fmt::format("{}{} {}", warnings.empty() ? "" : ", ", driven.axis, what);
    };
    warn(state.flags.hot, "driver hot");
    warn(state.flags.open_load && !state.standstill, "motor wire open");
    return Compare(driven, state.mscnt);
  }

  std::vector<Driven> drivers_;
  std::unique_ptr<Motion> inner_;
  std::mutex mutex_;  // guards the two below
  std::optional<Error> fault_;
  std::string warnings_;
};

}  // namespace

bool HasTmc2209(const Tmc2209Config& turntable, const Tmc2209Config& lift) {
  return !turntable.port.empty() || !lift.port.empty();
}

Status ValidateTmc2209s(const Tmc2209Config& turntable, const Tmc2209Config& lift) {
  for (const auto& [axis, config] :
       {std::pair("turntable", &turntable), std::pair("lift", &lift)}) {
    if (config->port.empty()) continue;
    if (const Status valid = ValidateTmc2209(*config); !valid) {
      return BadInput(valid.error().what,
                      fmt::format("axis.{}.tmc2209.{}", axis, valid.error().where),
                      valid.error().mend);
    }
  }
  if (!lift.port.empty() && turntable.port == lift.port && turntable.address == lift.address) {
    return BadInput("both axes name the same driver", "axis.lift.tmc2209.address",
                    "name an address each");
  }
  return {};
}

Result<std::unique_ptr<Motion>> MakeTmc2209Motion(const Tmc2209Config& turntable,
                                                  const Tmc2209Config& lift,
                                                  const SerialOpener& open,
                                                  const StepMotionMaker& make) {
  SCAN_CHECK(ValidateTmc2209s(turntable, lift));
  std::vector<Driven> drivers;
  for (const auto& [axis, config] :
       {std::pair("turntable", &turntable), std::pair("lift", &lift)}) {
    if (config->port.empty()) continue;
    Driven driven;
    driven.axis = axis;
    driven.config = *config;
    if (!drivers.empty() && drivers.front().config.port == config->port) {
      driven.bus = drivers.front().bus;
    } else {
      SCAN_TRY(driven.bus, Tmc2209Bus::Open(open, config->port));
    }
    SCAN_CHECK(SetUp(driven));  // before the motors get their current
    drivers.push_back(std::move(driven));
  }
  SCAN_TRY(auto inner, make([&](const std::string& axis, std::unique_ptr<StepPort> port) {
             for (const Driven& driven : drivers) {
               if (driven.axis != axis) continue;
               port = std::make_unique<CountedStepPort>(std::move(port), driven.sent);
             }
             return port;
           }));
  return std::make_unique<Tmc2209Motion>(std::move(drivers), std::move(inner));
}

}  // namespace scan
