#include "drivers/motion/power_readback.h"

#include <gtest/gtest.h>

#include <vector>

namespace scan {
namespace {

constexpr std::int64_t kNever = 3'600'000'000'000;

// What was reported, in turn.
class Reports {
 public:
  PowerReadback::Report Sink() {
    return [this](bool not_cut) {
      const std::lock_guard lock(mutex_);
      all_.push_back(not_cut);
      changed_.notify_all();
    };
  }
  std::vector<bool> First(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return all_.size() >= count; });
    return all_;
  }
  std::vector<bool> SoFar() { return First(0); }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<bool> all_;
};

TEST(PowerReadback, ASupplyThatStaysIsReportedAndItsEndAsWell) {
  Reports reports;
  PowerReadback readback(1, true, reports.Sink());
  readback.OnEmergencyStop(true);
  EXPECT_EQ(reports.First(1), (std::vector{true}));
  readback.OnPower(false);
  EXPECT_EQ(reports.First(2), (std::vector{true, false}));
  readback.OnPower(true);
  EXPECT_EQ(reports.First(3), (std::vector{true, false, true}));
}

TEST(PowerReadback, ItEndsInEveryState) {
  for (const bool pressed : {false, true}) {
    for (const bool there : {false, true}) {
      Reports reports;
      {
        PowerReadback readback(kNever, true, reports.Sink());
        readback.OnPower(there);
        readback.OnEmergencyStop(pressed);
      }
      EXPECT_TRUE(reports.SoFar().empty()) << "the time was not over";
    }
  }
  Reports reports;
  PowerReadback readback(1, true, reports.Sink());
  readback.OnEmergencyStop(true);
  EXPECT_EQ(reports.First(1), (std::vector{true}));
}

TEST(PowerReadback, AnInputThatIsNotWiredReportsNothing) {
  Reports reports;
  {
    PowerReadback readback(1, false, reports.Sink());
    readback.OnEmergencyStop(true);
  }
  EXPECT_TRUE(reports.SoFar().empty());
}

}  // namespace
}  // namespace scan
