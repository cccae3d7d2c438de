#include "drivers/motion/axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "drivers/motion/axis_target.h"

namespace scan {
namespace {

constexpr std::int64_t kReversalPauseNs = 10'000'000;  // lets the rotor come to rest
constexpr double kOvershootPerBacklash = 1.5;          // takes the play up with some to spare
constexpr double kLateFraction = 0.25;                 // of the step period

}  // namespace

Axis::Axis(AxisConfig config, std::unique_ptr<StepPort> port)
    : config_(std::move(config)), port_(std::move(port)) {
  assert(port_ && config_.steps_per_unit > 0 && std::abs(config_.sign) == 1);
}

AxisReading Axis::Reading() const {
  return {commanded_, CountedUnits(), estimated_, config_.sigma_shared, config_.sigma_view};
}

double Axis::CountedUnits() const {
  return origin_ + config_.sign * static_cast<double>(count_) / config_.steps_per_unit;
}

std::int64_t Axis::StepsAt(double units) const {
  return std::llround((units - origin_) * config_.sign * config_.steps_per_unit);
}

StepLimits Axis::LimitsAt(double velocity) const {
  const auto steps = [&](double rate) {
    return std::clamp<std::int64_t>(std::llround(rate * config_.steps_per_unit), 1, 10'000'000);
  };
  return {steps(velocity), steps(config_.acceleration), steps(config_.self_start)};
}

void Axis::Advance(AxisEvent event) {
  const auto next = Next(state_, event);
  assert(next && "the owner asked for what the axis table excludes");
  if (next) state_ = *next;
}

Status Axis::CheckTarget(double target) const {
  return CheckAxisTarget(config_, state_, fault_, target);
}

Status Axis::BeginHoming() {
  SCAN_CHECK(port_->Enable(true));
  SCAN_CHECK(port_->Brake(false));
  if (state_ == AxisState::fault) Advance(AxisEvent::acknowledged);
  if (state_ == AxisState::unpowered) Advance(AxisEvent::powered);
  fault_.clear();
  referenced_ = false;
  return {};
}

Status Axis::BeginMove(double target, std::int64_t base_ns) {
  SCAN_CHECK(port_->Enable(true));
  SCAN_CHECK(port_->Brake(false));
  commanded_ = target;
  const std::int64_t goal = StepsAt(target);
  waypoints_.clear();
  const bool from_wrong_side = (goal - count_) * config_.sign * config_.approach < 0;
  if (config_.backlash > 0 && from_wrong_side) {
    waypoints_.push_back(
        StepsAt(target - config_.approach * kOvershootPerBacklash * config_.backlash));
  }
  waypoints_.push_back(goal);
  segment_velocity_ = config_.velocity;
  StartSegment(base_ns);
  return BeginEdges();
}

Status Axis::BeginTravel(double distance, double velocity, std::int64_t base_ns) {
  waypoints_.assign({count_ + std::llround(distance * config_.sign * config_.steps_per_unit)});
  segment_velocity_ = velocity;
  StartSegment(base_ns);
  return BeginEdges();
}

// The direction now, so that its set-up time has passed when the first edge is due.
Status Axis::BeginEdges() {
  if (!NextDeadlineNs()) return {};
  SCAN_CHECK(port_->SetDirection(plan_.direction() > 0));
  Advance(AxisEvent::motion_started);
  return {};
}

void Axis::StartSegment(std::int64_t base_ns) {
  stopping_ = false;
  stop_offsets_ns_.clear();
  next_stop_edge_ = 0;
  next_edge_ = 0;
  base_ns_ = base_ns;
  plan_ = StepPlan();
  while (!waypoints_.empty() && plan_.count() == 0) {
    plan_ = StepPlan(count_, waypoints_.front(), LimitsAt(segment_velocity_));
    waypoints_.pop_front();
  }
  FindNextDeadline();
}

void Axis::FindNextDeadline() {
  next_deadline_ns_.reset();
  if (stopping_) {
    if (next_stop_edge_ < stop_offsets_ns_.size()) {
      next_deadline_ns_ = base_ns_ + stop_offsets_ns_[next_stop_edge_];
    }
  } else if (next_edge_ < plan_.count()) {
    next_deadline_ns_ = base_ns_ + plan_.OffsetNs(next_edge_);
  }
}

Status Axis::EmitNext(std::int64_t now_ns) {
  assert(next_deadline_ns_);
  const std::int64_t deadline_ns = *next_deadline_ns_;
  if (now_ns > deadline_ns) SCAN_CHECK(AcceptLateStep(now_ns - deadline_ns));
  if (!stopping_ && next_edge_ == 0) SCAN_CHECK(port_->SetDirection(plan_.direction() > 0));
  SCAN_CHECK(port_->EmitEdge(deadline_ns));
  count_ += plan_.direction();
  last_edge_ns_ = std::max(now_ns, deadline_ns);
  last_sense_ = plan_.direction() * config_.sign;
  FollowBacklash();
  if (stopping_) {
    ++next_stop_edge_;
    FindNextDeadline();
  } else if (++next_edge_ == plan_.count() && !waypoints_.empty()) {
    StartSegment(base_ns_ + plan_.duration_ns() + kReversalPauseNs);
  } else {
    FindNextDeadline();
  }
  return {};
}

Status Axis::AcceptLateStep(std::int64_t late_ns) {
  const std::int64_t edge = stopping_ ? plan_.count() / 2 : next_edge_;
  const auto speed_squared = static_cast<double>(plan_.SpeedSquared(edge));
  if (static_cast<double>(late_ns) * std::sqrt(speed_squared) <= kLateFraction * 1e9) {
    return {};
  }
  // The first step of a ramp already has one step's worth of acceleration.
  const StepLimits& limits = plan_.limits();
  const auto self_start = static_cast<double>(limits.self_start);
  if (speed_squared > self_start * self_start + 2.0 * static_cast<double>(limits.acceleration)) {
    SetFault(fmt::format("step {} us late above the self-starting rate", late_ns / 1000));
    return DeviceFault(fault_, config_.name,
                       "lower the velocity or the load of this machine, then home again");
  }
  base_ns_ += late_ns;
  ++late_shifts_;
  shifted_ns_ += late_ns;
  return {};
}

// The play: what it drives lags by up to `backlash` on the side that the last approach does not
// use.
void Axis::FollowBacklash() {
  const double x = CountedUnits();
  const double low = config_.approach > 0 ? x : x - config_.backlash;
  const double high = config_.approach > 0 ? x + config_.backlash : x;
  estimated_ = std::clamp(estimated_, low, high);
}

void Axis::BeginStop() {
  if (stopping_ || !NextDeadlineNs()) return;
  waypoints_.clear();
  stopping_ = true;
  next_stop_edge_ = 0;
  stop_offsets_ns_.clear();
  if (next_edge_ > 0) {
    stop_offsets_ns_ = StopRampNs(plan_, next_edge_ - 1);
    base_ns_ = last_edge_ns_;
  }
  FindNextDeadline();
}

Status Axis::EndMove() {
  const bool stopped = stopping_;
  ClearMotion();
  if (state_ != AxisState::moving) return {};
  if (!referenced_) {
    Advance(AxisEvent::aborted);  // homing is not yet done
    return {};
  }
  Advance(stopped ? AxisEvent::stopped : AxisEvent::arrived);
  if (!stopped || config_.on_stop == OnStop::hold) return {};
  if (config_.on_stop == OnStop::brake) return port_->Brake(true);
  referenced_ = false;
  Advance(AxisEvent::released);
  return port_->Enable(false);
}

void Axis::ClearMotion() {
  waypoints_.clear();
  plan_ = StepPlan();
  next_edge_ = 0;
  stopping_ = false;
  stop_offsets_ns_.clear();
  next_stop_edge_ = 0;
  next_deadline_ns_.reset();
}

void Axis::Abort() {
  ClearMotion();
  referenced_ = false;
  Advance(AxisEvent::aborted);
}

void Axis::SetFault(std::string what) {
  ClearMotion();
  referenced_ = false;
  fault_ = std::move(what);
  Advance(AxisEvent::faulted);
}

void Axis::CutPower(std::string why) {
  SetFault(std::move(why));
  (void)port_->Brake(true);  // a port that does not answer changes nothing: it is a fault already
  (void)port_->Enable(false);
}

Result<bool> Axis::HomeSwitch() {
  return config_.homing.kind == HomingKind::endstop ? port_->Endstop() : port_->Index();
}

void Axis::SetReference() {
  ClearMotion();
  count_ = 0;
  origin_ = config_.homing.position;
  estimated_ = config_.homing.position;
  commanded_ = config_.homing.position;
  referenced_ = true;
  Advance(AxisEvent::homed);
}

}  // namespace scan
