#include "drivers/motion/step_plan.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>

namespace scan {
namespace {

__extension__ typedef __int128 Wide;

constexpr std::int64_t kSecondNs = 1'000'000'000;

// Largest integer whose square is at most `n`.
Wide IntegerSqrt(Wide n) {
  if (n <= 0) return 0;
  Wide root = static_cast<Wide>(std::sqrt(static_cast<long double>(n)));
  // The estimate has 64 good bits and the root at most 64: a few single steps make it exact.
  while (root * root > n) --root;
  while ((root + 1) * (root + 1) <= n) ++root;
  return root;
}

// sqrt(speed_squared) in 10^-9 steps/s.
Wide NanoSpeed(Wide speed_squared) { return IntegerSqrt(speed_squared * kSecondNs * kSecondNs); }

Wide CeilDiv(Wide a, Wide b) { return (a + b - 1) / b; }

}  // namespace

StepPlan::StepPlan(std::int64_t from_steps, std::int64_t to_steps, const StepLimits& limits)
    : limits_(limits),
      count_(std::llabs(to_steps - from_steps)),
      direction_(to_steps > from_steps ? 1 : (to_steps < from_steps ? -1 : 0)) {
  assert(limits.velocity >= 1 && limits.acceleration >= 1 && limits.self_start >= 1);
  limits_.self_start = std::min(limits_.self_start, limits_.velocity);
  if (count_ == 0) return;
  const Wide v = limits_.velocity, v0 = limits_.self_start, a = limits_.acceleration;
  const Wide n = count_;
  const bool reaches_velocity = v * v - v0 * v0 <= a * n;
  duration_ns_ = static_cast<std::int64_t>(
      reaches_velocity ? CeilDiv(((v - v0) * (v - v0) + n * a) * kSecondNs, a * v)
                       : CeilDiv(2 * (NanoSpeed(v0 * v0 + a * n) - v0 * kSecondNs), a));
}

// s(t) = v0 t + a t^2 / 2 up to v, then constant; t where s = k + 1/2.
std::int64_t StepPlan::FirstHalfOffsetNs(std::int64_t k) const {
  const Wide v = limits_.velocity, v0 = limits_.self_start, a = limits_.acceleration;
  const Wide twice_s = 2 * Wide{k} + 1;
  if (v * v - v0 * v0 <= a * twice_s) {
    return static_cast<std::int64_t>(((v - v0) * (v - v0) + twice_s * a) * kSecondNs / (2 * a * v));
  }
  return static_cast<std::int64_t>((NanoSpeed(v0 * v0 + a * twice_s) - v0 * kSecondNs) / a);
}

std::int64_t StepPlan::OffsetNs(std::int64_t k) const {
  assert(k >= 0 && k < count_);
  const std::int64_t mirrored = count_ - 1 - k;
  return k <= mirrored ? FirstHalfOffsetNs(k) : duration_ns_ - FirstHalfOffsetNs(mirrored);
}

std::int64_t StepPlan::SpeedSquared(std::int64_t k) const {
  const Wide v = limits_.velocity, v0 = limits_.self_start, a = limits_.acceleration;
  const Wide twice_s = 2 * Wide{std::min(k, count_ - 1 - k)} + 1;
  return static_cast<std::int64_t>(std::min(v * v, v0 * v0 + a * twice_s));
}

std::vector<std::int64_t> DeadlinesNs(const StepPlan& plan, std::int64_t base_ns) {
  std::vector<std::int64_t> deadlines(static_cast<std::size_t>(plan.count()));
  for (std::int64_t k = 0; k < plan.count(); ++k) {
    deadlines[static_cast<std::size_t>(k)] = base_ns + plan.OffsetNs(k);
  }
  return deadlines;
}

std::vector<std::int64_t> StopRampNs(const StepPlan& plan, std::int64_t last) {
  assert(last >= 0 && last < plan.count());
  const Wide a = plan.limits().acceleration, v0 = plan.limits().self_start;
  const Wide speed_squared = plan.SpeedSquared(last);
  const Wide needed = (speed_squared - v0 * v0) / (2 * a);
  const auto count = static_cast<std::int64_t>(std::min<Wide>(needed, plan.count() - 1 - last));
  const Wide start = NanoSpeed(speed_squared);
  std::vector<std::int64_t> offsets;
  offsets.reserve(static_cast<std::size_t>(count));
  for (std::int64_t j = 1; j <= count; ++j) {
    offsets.push_back(
        static_cast<std::int64_t>((start - NanoSpeed(speed_squared - 2 * a * j)) / a));
  }
  return offsets;
}

}  // namespace scan
