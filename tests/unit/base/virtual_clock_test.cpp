#include "drivers/base/virtual_clock.h"

#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <queue>
#include <string>
#include <thread>
#include <vector>

namespace scan {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST(VirtualClock, AloneItSimplyAdvances) {
  VirtualClock clock;
  const Timestamp start = clock.Now();
  EXPECT_EQ(start.utc_ns, kVirtualStartUtcNs);
  EXPECT_TRUE(clock.SleepFor(3'600'000 * kMs));
  EXPECT_EQ(clock.Now().mono_ns - start.mono_ns, 3'600'000 * kMs);
  EXPECT_EQ(clock.Now().utc_ns - start.utc_ns, 3'600'000 * kMs);
}

TEST(VirtualClock, ParticipantsWakeInTheOrderOfTheirDeadlines) {
  for (int repeat = 0; repeat < 20; ++repeat) {
    VirtualClock clock;
    const std::int64_t start = clock.Now().mono_ns;
    std::mutex mutex;
    std::vector<std::pair<std::int64_t, int>> log;
    std::vector<std::thread> threads;
    for (int id = 0; id < 3; ++id) clock.MessageSent();  // time stands until all have joined
    for (int id = 0; id < 3; ++id) {
      threads.emplace_back([&, id] {
        Participation part(&clock, /*takes_over_message=*/true);
        for (int k = 1; k <= 50; ++k) {
          ASSERT_TRUE(clock.SleepUntil(start + k * (id + 2) * kMs));
          std::lock_guard lock(mutex);
          log.emplace_back(clock.Now().mono_ns - start, id);
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    ASSERT_EQ(log.size(), 150U);
    for (std::size_t i = 0; i < log.size(); ++i) {
      EXPECT_EQ(log[i].first % ((log[i].second + 2) * kMs), 0);
      if (i > 0) {
        EXPECT_LE(log[i - 1].first, log[i].first);
      }
    }
    EXPECT_EQ(clock.Now().mono_ns - start, 50 * 4 * kMs);
  }
}

// A channel as the daemons have it, between threads.
class Channel {
 public:
  explicit Channel(Activity* activity) : activity_(activity) {}
  void Send(int message) {
    activity_->MessageSent();
    std::lock_guard lock(mutex_);
    queue_.push(message);
    ready_.notify_one();
  }
  int Receive() {
    BlockingWait wait(activity_);
    std::unique_lock lock(mutex_);
    ready_.wait(lock, [&] { return !queue_.empty(); });
    const int message = queue_.front();
    queue_.pop();
    wait.TookMessage();
    return message;
  }

 private:
  Activity* activity_;
  std::mutex mutex_;
  std::condition_variable ready_;
  std::queue<int> queue_;
};

TEST(VirtualClock, TimeStandsWhileAReplyIsUnderWay) {
  VirtualClock clock;
  Channel requests(&clock), replies(&clock);
  Participation client(&clock);
  clock.MessageSent();
  std::thread server([&] {
    Participation part(&clock, true);
    for (;;) {
      const int request = requests.Receive();
      std::this_thread::yield();  // any real delay of the reply
      if (request > 0) clock.SleepFor(request * kMs);
      replies.Send(request);
      if (request < 0) return;
    }
  });
  clock.MessageSent();
  std::thread watchdog([&] {  // would gladly let time run away
    Participation part(&clock, true);
    for (int k = 0; k < 1000; ++k) clock.SleepFor(1000 * kMs);
  });
  for (int k = 0; k < 200; ++k) {
    const std::int64_t before = clock.Now().mono_ns;
    requests.Send(k % 5);
    EXPECT_EQ(replies.Receive(), k % 5);
    EXPECT_EQ(clock.Now().mono_ns - before, (k % 5) * kMs);
  }
  requests.Send(-1);
  replies.Receive();
  {
    BlockingWait joining(&clock);
    server.join();
    watchdog.join();
  }
}

TEST(VirtualClock, AStopWakesASleeperBeforeTimeMovesOn) {
  VirtualClock clock;
  const std::int64_t start = clock.Now().mono_ns;
  std::stop_source stop;
  Participation main_part(&clock);
  bool completed = true;
  std::int64_t woken_ns = 0;
  clock.MessageSent();
  std::thread sleeper([&] {
    Participation part(&clock, true);
    completed = clock.SleepUntil(start + 1000 * kMs, stop.get_token());
    woken_ns = clock.Now().mono_ns;
  });
  ASSERT_TRUE(clock.SleepUntil(start + 10 * kMs));
  stop.request_stop();
  ASSERT_TRUE(clock.SleepUntil(start + 5000 * kMs));
  {
    BlockingWait joining(&clock);
    sleeper.join();
  }
  EXPECT_FALSE(completed);
  EXPECT_EQ(woken_ns, start + 10 * kMs);
  EXPECT_FALSE(clock.SleepUntil(start + 6000 * kMs, stop.get_token()));
  EXPECT_EQ(clock.Now().mono_ns, start + 5000 * kMs);
}

TEST(VirtualClock, AMessageThatNobodyReadsCanBeDropped) {
  VirtualClock clock;
  Participation part(&clock);
  clock.MessageSent();
  std::thread closer([&] { clock.MessageDropped(); });
  EXPECT_TRUE(clock.SleepFor(5 * kMs));  // returns only after the drop
  closer.join();
}

}  // namespace
}  // namespace scan
