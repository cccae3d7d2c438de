#include "drivers/motion/step_plan.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>

namespace scan {
namespace {

struct Case {
  std::int64_t from = 0, to = 0;
  StepLimits limits;
};

Case AnyCase(std::int64_t max_steps) {
  Case c;
  c.from = *rc::gen::inRange<std::int64_t>(-1'000'000, 1'000'000);
  c.to = c.from + *rc::gen::inRange<std::int64_t>(-max_steps, max_steps);
  c.limits.velocity = *rc::gen::inRange<std::int64_t>(1, 50'000);
  c.limits.acceleration = *rc::gen::inRange<std::int64_t>(1, 500'000);
  c.limits.self_start = *rc::gen::inRange<std::int64_t>(1, 5'000);
  return c;
}

TEST(StepPlan, CountAndDirectionAreThoseAsked) {
  EXPECT_TRUE(rc::check([] {
    const Case c = AnyCase(2000);
    const StepPlan plan(c.from, c.to, c.limits);
    RC_ASSERT(plan.count() == std::llabs(c.to - c.from));
    RC_ASSERT(c.from + plan.direction() * plan.count() == c.to);
    RC_ASSERT(std::ssize(DeadlinesNs(plan, 0)) == plan.count());
  }));
}

TEST(StepPlan, EdgesAreMonotoneKeepTheVelocityAndMirror) {
  EXPECT_TRUE(rc::check([] {
    const Case c = AnyCase(2000);
    const StepPlan plan(c.from, c.to, c.limits);
    const auto edges = DeadlinesNs(plan, 0);
    const auto n = static_cast<std::int64_t>(edges.size());
    for (std::int64_t k = 0; k < n; ++k) {
      RC_ASSERT(edges[k] >= 0);
      RC_ASSERT(edges[k] <= plan.duration_ns());
      if (k == 0) continue;
      const std::int64_t interval = edges[k] - edges[k - 1];
      RC_ASSERT(interval > 0);
      // Rounding to whole ns moves an edge by less than 1 ns, the mirrored one by 2.
      RC_ASSERT((interval + 3) * c.limits.velocity >= 1'000'000'000);
      RC_ASSERT(std::llabs(edges[k] - edges[k - 1] - (edges[n - k] - edges[n - 1 - k])) <= 3);
    }
  }));
}

TEST(StepPlan, AccelerationStaysBelowItsLimit) {
  EXPECT_TRUE(rc::check([] {
    Case c = AnyCase(2000);
    c.limits.velocity = *rc::gen::inRange<std::int64_t>(1, 5'000);
    const StepPlan plan(c.from, c.to, c.limits);
    const auto edges = DeadlinesNs(plan, 0);
    for (std::size_t k = 2; k < edges.size(); ++k) {
      const double before = 1e9 / static_cast<double>(edges[k - 1] - edges[k - 2]);
      const double after = 1e9 / static_cast<double>(edges[k] - edges[k - 1]);
      const double seconds = static_cast<double>(edges[k] - edges[k - 2]) * 0.5e-9;
      // A mean speed is known to 3 ns of its interval.
      const double slack = 3e-9 * (before * before + after * after) / seconds;
      RC_ASSERT(std::abs(after - before) / seconds <=
                static_cast<double>(c.limits.acceleration) * (1 + 1e-6) + slack);
    }
  }));
}

TEST(StepPlan, ClosedFormDoesNotDriftOverAMillionSteps) {
  const StepLimits limits{7001, 12'347, 313};
  const StepPlan plan(0, 1'000'000, limits);
  const double v = 7001, v0 = 313, a = 12'347;
  const double ramp_steps = (v * v - v0 * v0) / (2 * a);
  const double ramp_s = (v - v0) / a;
  for (const std::int64_t k : {0L, 1L, 999L, 123'456L, 499'999L, 500'000L, 876'543L, 999'999L}) {
    const double s = static_cast<double>(k) + 0.5, n = 1e6;
    const double total = 2 * ramp_s + (n - 2 * ramp_steps) / v;
    const auto ramp = [&](double d) { return (std::sqrt(v0 * v0 + 2 * a * d) - v0) / a; };
    const double expected = s < ramp_steps       ? ramp(s)
                            : n - s < ramp_steps ? total - ramp(n - s)
                                                 : ramp_s + (s - ramp_steps) / v;
    EXPECT_NEAR(static_cast<double>(plan.OffsetNs(k)), expected * 1e9, 50) << k;
  }
  // At constant velocity edge k + 7001 is exactly one second later.
  EXPECT_EQ(plan.OffsetNs(400'000 + 7001) - plan.OffsetNs(400'000), 1'000'000'000);
}

TEST(StepPlan, StopRampBrakesWithinTheLimitsAndInsideThePlan) {
  EXPECT_TRUE(rc::check([] {
    Case c = AnyCase(3000);
    RC_PRE(c.from != c.to);
    const StepPlan plan(c.from, c.to, c.limits);
    const auto last = *rc::gen::inRange<std::int64_t>(0, plan.count());
    const auto ramp = StopRampNs(plan, last);
    RC_ASSERT(std::ssize(ramp) <= plan.count() - 1 - last);
    const double v0 = static_cast<double>(plan.limits().self_start);
    const double a = static_cast<double>(c.limits.acceleration);
    const double speed_squared = static_cast<double>(plan.SpeedSquared(last));
    RC_ASSERT(static_cast<double>(ramp.size()) <= (speed_squared - v0 * v0) / (2 * a) + 1e-9);
    // What is left after the ramp could be stopped at once.
    if (std::ssize(ramp) < plan.count() - 1 - last) {
      const double left = speed_squared - 2 * a * static_cast<double>(ramp.size());
      RC_ASSERT(left < v0 * v0 + 2 * a);
    }
    std::int64_t before = 0, interval_before = 0;
    for (const std::int64_t offset : ramp) {
      RC_ASSERT(offset > before);
      RC_ASSERT(offset - before + 3 >= interval_before);
      interval_before = offset - before;
      before = offset;
    }
  }));
}

TEST(StepPlan, AMoveOfNothingHasNoEdges) {
  const StepPlan plan(5, 5, {100, 100, 10});
  EXPECT_EQ(plan.count(), 0);
  EXPECT_EQ(plan.direction(), 0);
  EXPECT_TRUE(DeadlinesNs(plan, 7).empty());
}

TEST(StepPlan, BelowTheSelfStartingRateTheRateIsConstant) {
  const StepPlan plan(0, 10, {100, 1000, 500});
  for (std::int64_t k = 1; k < 10; ++k) {
    EXPECT_EQ(plan.OffsetNs(k) - plan.OffsetNs(k - 1), 10'000'000);
  }
  EXPECT_TRUE(StopRampNs(plan, 4).empty());
}

}  // namespace
}  // namespace scan
