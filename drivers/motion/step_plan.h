// From where to where under which limits: the absolute deadlines of step edges.
#pragma once

#include <cstdint>
#include <vector>

namespace scan {

// Whole steps per second and per second squared; all at least 1. At `self_start` the motor starts
// and stops without a ramp; a velocity at or below it gives a constant rate.
struct StepLimits {
  std::int64_t velocity = 1;
  std::int64_t acceleration = 1;
  std::int64_t self_start = 1;
  friend bool operator==(const StepLimits&, const StepLimits&) = default;
};

// A move from rest to rest with a trapezoidal (or triangular) ramp over |to - from| steps. Edge k
// falls where the continuous profile passes k + 1/2 steps, so the plan is its own mirror image.
// Every deadline comes from a closed form in integers: nothing accumulates, however long the move.
// Preconditions: rates in [1, 10^7], at most 2^40 steps.
// Thread contract: plain value.
class StepPlan {
 public:
  StepPlan() = default;
  StepPlan(std::int64_t from_steps, std::int64_t to_steps, const StepLimits& limits);

  std::int64_t count() const { return count_; }
  int direction() const { return direction_; }  // +1, -1; 0 without steps
  const StepLimits& limits() const { return limits_; }
  std::int64_t duration_ns() const { return duration_ns_; }

  // Edge k in [0, count), ns after the time base (the start of the move).
  std::int64_t OffsetNs(std::int64_t k) const;
  // Square of the speed at edge k, (steps/s)^2.
  std::int64_t SpeedSquared(std::int64_t k) const;

 private:
  std::int64_t FirstHalfOffsetNs(std::int64_t k) const;

  StepLimits limits_;
  std::int64_t count_ = 0;
  int direction_ = 0;
  std::int64_t duration_ns_ = 0;
};

// The deadlines of all edges, ns, for a move that starts at `base_ns`.
std::vector<std::int64_t> DeadlinesNs(const StepPlan& plan, std::int64_t base_ns);

// Ramps down from edge `last` (the last one emitted) of a plan: offsets in ns after that edge of
// the steps that still must follow. Never more than the plan had left; empty below the
// self-starting rate. Precondition: last in [0, count).
std::vector<std::int64_t> StopRampNs(const StepPlan& plan, std::int64_t last);

}  // namespace scan
