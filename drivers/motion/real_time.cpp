#include "drivers/motion/real_time.h"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>

namespace scan {
namespace {

// A wake-up is later than this only on a machine that is no good for motion anyway.
constexpr std::int64_t kSpinNs = 60'000;
constexpr std::int64_t kNoSleepNs = 20'000;  // pulses and set-up times: going to sleep takes longer
constexpr std::int64_t kLongestSleepNs = 2'000'000;  // a stop must begin within 20 ms

std::int64_t ReadClock(clockid_t id) {
  timespec t{};
  clock_gettime(id, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

// With a limit, locked future memory would make allocations fail later: then it stays unlocked.
bool LockMemory() {
  rlimit limit{};
  if (getrlimit(RLIMIT_MEMLOCK, &limit) != 0) return false;
  if (limit.rlim_cur != RLIM_INFINITY && geteuid() != 0) return false;
  return mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
}

}  // namespace

RealTimeGrant BecomeRealTime(const RealTimeOptions& options) {
  RealTimeGrant grant;
  if (options.priority > 0) {
    const sched_param parameter{options.priority};
    grant.fifo = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter) == 0;
    grant.memory_locked = LockMemory();
    if (!grant.fifo) grant.mend += "allow real-time scheduling (LimitRTPRIO=99 or CAP_SYS_NICE); ";
    if (!grant.memory_locked) grant.mend += "allow locked memory (LimitMEMLOCK=infinity); ";
  }
  if (options.core) {
    cpu_set_t cores;
    CPU_ZERO(&cores);
    CPU_SET(static_cast<std::size_t>(*options.core), &cores);
    grant.pinned = pthread_setaffinity_np(pthread_self(), sizeof(cores), &cores) == 0;
    if (!grant.pinned) grant.mend += "choose a core that this machine has; ";
  }
  if (grant.mend.ends_with("; ")) grant.mend.resize(grant.mend.size() - 2);
  return grant;
}

Timestamp RealTimeClock::Now() { return {ReadClock(CLOCK_REALTIME), ReadClock(CLOCK_MONOTONIC)}; }

bool RealTimeClock::SleepUntil(std::int64_t mono_ns, std::stop_token stop) {
  for (std::int64_t now_ns = ReadClock(CLOCK_MONOTONIC); now_ns < mono_ns;
       now_ns = ReadClock(CLOCK_MONOTONIC)) {
    if (stop.stop_requested()) return false;
    const std::int64_t left_ns = mono_ns - now_ns;
    if (left_ns > kNoSleepNs) {
      const std::int64_t until_ns =
          std::min(mono_ns - std::min(kSpinNs, left_ns / 2), now_ns + kLongestSleepNs);
      const timespec until{until_ns / 1'000'000'000, until_ns % 1'000'000'000};
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
      if (mono_ns - until_ns > kSpinNs) continue;
    }
    while (ReadClock(CLOCK_MONOTONIC) < mono_ns) {
      if (stop.stop_requested()) return false;
    }
  }
  return !stop.stop_requested();
}

}  // namespace scan
