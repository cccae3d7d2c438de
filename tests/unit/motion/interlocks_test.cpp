#include "drivers/motion/interlocks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "drivers/base/rng.h"
#include "drivers/motion/lateness.h"
#include "drivers/motion/real_time.h"

namespace scan {
namespace {

using ::testing::HasSubstr;

constexpr AxisCommand kEveryCommand[] = {AxisCommand::home,    AxisCommand::move,
                                         AxisCommand::stop,    AxisCommand::abort,
                                         AxisCommand::release, AxisCommand::acknowledge};

TEST(Interlocks, EachForbidsWhatItsRowSaysFromItsCauseToItsMend) {
  for (const InterlockRow& row : kInterlockTable) {
    Interlocks interlocks;
    for (const AxisCommand command : kEveryCommand) EXPECT_TRUE(interlocks.Permit(command));
    interlocks.Raise(row.interlock);
    EXPECT_EQ(interlocks.alarm(), row.alarm);
    EXPECT_EQ(interlocks.Words(), row.name);
    for (const AxisCommand command : kEveryCommand) {
      EXPECT_EQ(interlocks.Permit(command).has_value(), !Forbids(row.interlock, command))
          << row.name;
    }
    interlocks.Acknowledge();
    EXPECT_TRUE(interlocks.IsUp(row.interlock)) << "its cause is still there";
    interlocks.CauseGone(row.interlock);
    EXPECT_FALSE(interlocks.IsUp(row.interlock));

    interlocks.Raise(row.interlock);
    interlocks.CauseGone(row.interlock);
    EXPECT_EQ(interlocks.IsUp(row.interlock), row.latched) << row.name;
    interlocks.Acknowledge();
    EXPECT_FALSE(interlocks.IsUp(row.interlock));
    EXPECT_EQ(interlocks.Words(), "");
  }
}

TEST(Interlocks, AHomingMendsOnlyThoseThatPermitIt) {
  for (const InterlockRow& row : kInterlockTable) {
    Interlocks interlocks;
    interlocks.Raise(row.interlock);
    interlocks.CauseGone(row.interlock);
    interlocks.Homed();
    EXPECT_EQ(interlocks.IsUp(row.interlock),
              row.latched && Forbids(row.interlock, AxisCommand::home))
        << row.name;
  }
}

TEST(Interlocks, TheWorstAlarmCountsAndAllAreNamed) {
  Interlocks interlocks;
  interlocks.Raise(Interlock::cover_open);
  interlocks.Raise(Interlock::emergency_stop);
  EXPECT_EQ(interlocks.alarm(), Alarm::invalid);
  EXPECT_EQ(interlocks.Words(), "cover open, emergency stop");
  const Status refused = interlocks.Permit(AxisCommand::move);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::device);
  EXPECT_THAT(refused.error().what, HasSubstr("cover open"));
}

TEST(Lateness, AQuantileIsItsBucketsUpperEnd) {
  LatenessHistogram none;
  EXPECT_EQ(none.QuantileNs(0.5), 0);
  Rng rng(3);
  std::vector<std::int64_t> all;
  LatenessHistogram histogram;
  for (int k = 0; k < 2000; ++k) {
    all.push_back(static_cast<std::int64_t>(std::exp(rng.Uniform(-1, 24))));
    histogram.Add(all.back());
  }
  histogram.Add(-5);  // early counts as not late
  all.push_back(0);
  std::sort(all.begin(), all.end());
  EXPECT_EQ(histogram.count(), 2001);
  EXPECT_EQ(histogram.max_ns(), all.back());
  EXPECT_EQ(histogram.QuantileNs(1), all.back());
  for (const double share : {0.01, 0.5, 0.9, 0.999}) {
    const auto exact = static_cast<double>(
        all[static_cast<std::size_t>(std::floor(share * 2001)) - (share == 1 ? 1 : 0)]);
    const auto bound = static_cast<double>(histogram.QuantileNs(share));
    EXPECT_GE(bound * 1.26 + 1, exact) << share;
    EXPECT_LE(bound, exact * 1.26 + 1) << share;
  }
}

TEST(RealTimeClock, SleepsAreNeverShortAndATokenEndsThem) {
  RealTimeClock clock;
  for (const std::int64_t ns : {0, 1'000, 19'000, 21'000, 100'000, 3'000'000}) {
    const std::int64_t deadline_ns = clock.Now().mono_ns + ns;
    EXPECT_TRUE(clock.SleepUntil(deadline_ns));
    EXPECT_GE(clock.Now().mono_ns, deadline_ns);
  }
  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(clock.SleepUntil(clock.Now().mono_ns + 3'600'000'000'000, stop.get_token()));
}

}  // namespace
}  // namespace scan
