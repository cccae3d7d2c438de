// How late steps are on this machine: the whole GPIO motion on lines that only note the time,
// against a bare SCHED_FIFO loop of clock_nanosleep, in interleaved pairs; idle and with every core
// loaded. The bare loop also shows what the machine takes from a thread between two instructions:
// it does nothing for as long as the player usually works between wake-up and line call.
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>
#include <vector>

#include "clocks.h"
#include "drivers/base/log.h"
#include "drivers/io/gpio/sim_gpio_board.h"
#include "drivers/motion/gpio/gpio_motion.h"
#include "drivers/motion/real_time.h"

namespace scan {
namespace {

struct Options {
  int pairs = 20;
  double seconds = 1;  // of each half of a pair
  int rate = 1200;     // steps a second
};

std::int64_t Ns(clockid_t id) {
  timespec t{};
  clock_gettime(id, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

// What was noted of one run; filled without allocation.
struct Notes {
  std::vector<std::int64_t> late_ns;   // line call after its deadline
  std::vector<std::int64_t> share_ns;  // line call after the wake-up
  void Reserve(std::size_t steps) {
    late_ns.reserve(steps);
    share_ns.reserve(steps);
  }
};

double QuantileUs(std::vector<std::int64_t> ns, double share) {
  if (ns.empty()) return NAN;
  const auto at = static_cast<std::size_t>(
      std::min(std::ceil(share * static_cast<double>(ns.size())), double(ns.size())) - 1);
  std::nth_element(ns.begin(), ns.begin() + static_cast<std::ptrdiff_t>(at), ns.end());
  return static_cast<double>(ns[at]) * 1e-3;
}

// The clock of the motion; knows the deadline that the player slept for and when it woke.
class NotingClock final : public Clock {
 public:
  Timestamp Now() override { return real_.Now(); }
  bool SleepUntil(std::int64_t mono_ns, std::stop_token stop) override {
    const bool player = stop.stop_possible();  // pulses and set-up times cannot be stopped
    const bool slept = real_.SleepUntil(mono_ns, std::move(stop));
    if (player) {
      woke_ns = Ns(CLOCK_MONOTONIC);
      deadline_ns = mono_ns;
    }
    return slept;
  }
  std::int64_t woke_ns = 0, deadline_ns = 0;  // of the stepping thread

 private:
  RealTimeClock real_;
};

// The step line: on the board while homing, afterwards it only notes the time.
class NotingLine final : public GpioLines {
 public:
  NotingLine(std::unique_ptr<GpioLines> inner, NotingClock& clock, std::atomic<Notes*>& notes)
      : inner_(std::move(inner)), clock_(clock), notes_(notes) {}
  std::size_t size() const override { return inner_->size(); }
  Status Set(std::span<const GpioLevel> levels) override {
    const std::int64_t now_ns = Ns(CLOCK_MONOTONIC);
    Notes* notes = notes_;
    if (!notes) return inner_->Set(levels);
    if (levels[0].active) {
      notes->late_ns.push_back(now_ns - clock_.deadline_ns);
      notes->share_ns.push_back(now_ns - clock_.woke_ns);
    }
    return {};
  }
  Result<bool> Get(std::size_t line) override { return inner_->Get(line); }
  Result<std::optional<GpioEdge>> WaitEdge(std::int64_t timeout_ns, int stop_fd) override {
    return inner_->WaitEdge(timeout_ns, stop_fd);
  }

 private:
  std::unique_ptr<GpioLines> inner_;
  NotingClock& clock_;
  std::atomic<Notes*>& notes_;
};

AxisConfig AxisOf(const char* name, HomingKind kind, int rate) {
  AxisConfig axis;
  axis.name = name;
  axis.unit = "steps";
  axis.velocity = axis.self_start = rate;  // without a ramp: every step has the same period
  axis.acceleration = 10.0 * rate;
  axis.homing = {kind, 1, 0, 200, 20, 10, 300};
  axis.on_stop = OnStop::hold;
  return axis;
}

// Two motors of which only the turntable moves once they are homed.
class Player {
 public:
  explicit Player(const Options& options) : options_(options) {}

  Status Start() {
    GpioMotionParts parts;
    parts.turntable = AxisOf("turntable", HomingKind::index, options_.rate);
    parts.lift = AxisOf("lift", HomingKind::endstop, options_.rate);
    parts.gpio.chip = "board";
    parts.gpio.turntable.step = {"TS"};
    parts.gpio.turntable.direction = {"TD"};
    parts.gpio.turntable.index = {"INDEX"};
    parts.gpio.lift.step = {"LS"};
    parts.gpio.lift.direction = {"LD"};
    parts.gpio.lift.endstop = {"ENDSTOP"};
    parts.aim_ids = {"a0"};
    board_->Listen([this](unsigned line, bool high) {
      level_[line] = high;
      if (high && (line == 0 || line == 2)) at_[line] += level_[line + 1] ? 1 : -1;
    });
    const auto open = [this](const GpioRequest& request) -> Result<std::unique_ptr<GpioLines>> {
      SCAN_TRY(auto lines, board_->Open(request));
      if (request.lines[0].name != "TS") return lines;
      return std::make_unique<NotingLine>(std::move(lines), *clock_, notes_);
    };
    SCAN_TRY(motion_, MakeGpioMotion(parts, open, clock_));
    const std::jthread switches([this](std::stop_token stop) {
      while (!stop.stop_requested()) {
        board_->Drive("INDEX", at_[0] >= 60);
        board_->Drive("ENDSTOP", at_[2] >= 60);
        SystemClock().SleepFor(200'000);
      }
    });
    SCAN_CHECK(motion_->Home({}));
    return {};
  }

  // There, and with the next call back again.
  Status Run(Notes& notes) {
    target_ = target_ > 0 ? 0 : options_.rate * options_.seconds;
    notes_ = &notes;
    const auto moved = motion_->MoveTo({target_, 0, "a0"}, {});
    notes_ = nullptr;
    SCAN_CHECK(moved);
    return {};
  }

 private:
  const Options options_;
  std::shared_ptr<NotingClock> clock_ = std::make_shared<NotingClock>();
  std::shared_ptr<SimGpioBoard> board_ = std::make_shared<SimGpioBoard>(
      "board", std::vector<std::string>{"TS", "TD", "LS", "LD", "INDEX", "ENDSTOP"}, clock_);
  std::atomic<Notes*> notes_ = nullptr;
  std::atomic<std::int64_t> at_[4] = {};
  bool level_[4] = {};
  double target_ = 0;
  std::unique_ptr<Motion> motion_;
};

// `work_ns`: from each wake-up to where the line would be called.
void RunBare(const Options& options, std::int64_t work_ns, Notes& notes) {
  std::thread([&] {
    (void)BecomeRealTime({});
    const std::int64_t period_ns = 1'000'000'000 / options.rate;
    const auto steps = static_cast<std::int64_t>(options.rate * options.seconds);
    const std::int64_t base_ns = Ns(CLOCK_MONOTONIC) + 1'000'000;
    for (std::int64_t k = 0; k < steps; ++k) {
      const std::int64_t deadline_ns = base_ns + k * period_ns;
      const timespec until{deadline_ns / 1'000'000'000, deadline_ns % 1'000'000'000};
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
      const std::int64_t woke_ns = Ns(CLOCK_MONOTONIC);
      std::int64_t call_ns = woke_ns;
      while (call_ns < woke_ns + work_ns) call_ns = Ns(CLOCK_MONOTONIC);
      notes.late_ns.push_back(woke_ns - deadline_ns);
      notes.share_ns.push_back(call_ns - woke_ns);
    }
  }).join();
}

// Programs that keep every core busy, for as long as this and the thread that made it live.
class Burners {
 public:
  explicit Burners(unsigned count) {
    const pid_t self = ::getpid();
    for (unsigned k = 0; k < count; ++k) {
      const pid_t child = ::fork();
      if (child == 0) {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (::getppid() != self) ::_exit(0);  // it died before the line above
        std::atomic<unsigned> n = 0;
        for (;;) n.fetch_add(1, std::memory_order_relaxed);
      }
      if (child > 0) children_.push_back(child);
    }
  }
  ~Burners() {
    for (const pid_t child : children_) {
      ::kill(child, SIGKILL);
      ::waitpid(child, nullptr, 0);
    }
  }
  Burners(const Burners&) = delete;
  Burners& operator=(const Burners&) = delete;

 private:
  std::vector<pid_t> children_;
};

void Append(std::vector<std::int64_t>& all, const std::vector<std::int64_t>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

Status Measure(const Options& options, Player& player, const char* load) {
  Notes player_all, bare_all;
  std::vector<double> ratios;
  std::int64_t player_cpu_ns = 0, bare_cpu_ns = 0, player_ns = 0, bare_ns = 0;
  const double stolen_ms = 1e3 * bench::StolenSeconds();
  for (int k = 0; k < options.pairs; ++k) {
    Notes played, bare;
    const auto steps = static_cast<std::size_t>(options.rate * options.seconds) + 100;
    played.Reserve(steps);
    bare.Reserve(steps);
    const std::int64_t cpu0 = Ns(CLOCK_PROCESS_CPUTIME_ID), t0 = Ns(CLOCK_MONOTONIC);
    SCAN_CHECK(player.Run(played));
    player_cpu_ns += Ns(CLOCK_PROCESS_CPUTIME_ID) - cpu0;
    player_ns += Ns(CLOCK_MONOTONIC) - t0;
    const std::int64_t work_ns = std::llround(1e3 * QuantileUs(played.share_ns, 0.5));
    const std::int64_t cpu1 = Ns(CLOCK_PROCESS_CPUTIME_ID), t1 = Ns(CLOCK_MONOTONIC);
    RunBare(options, work_ns, bare);
    bare_cpu_ns += Ns(CLOCK_PROCESS_CPUTIME_ID) - cpu1;
    bare_ns += Ns(CLOCK_MONOTONIC) - t1;
    ratios.push_back(QuantileUs(played.late_ns, 0.5) / QuantileUs(bare.late_ns, 0.5));
    Append(player_all.late_ns, played.late_ns);
    Append(player_all.share_ns, played.share_ns);
    Append(bare_all.late_ns, bare.late_ns);
    Append(bare_all.share_ns, bare.share_ns);
  }
  std::sort(ratios.begin(), ratios.end());
  const auto line = [](const char* what, const std::vector<std::int64_t>& ns) {
    fmt::print("  {:<40} p50 {:8.2f}  p99 {:8.2f}  p99.9 {:8.2f}  max {:8.2f} us\n", what,
               QuantileUs(ns, 0.5), QuantileUs(ns, 0.99), QuantileUs(ns, 0.999), QuantileUs(ns, 1));
  };
  const auto percent = [](std::int64_t part, std::int64_t whole) {
    return 100 * static_cast<double>(part) / static_cast<double>(whole);
  };
  fmt::print("{}: {} pairs of {} s at {} steps/s\n", load, options.pairs, options.seconds,
             options.rate);
  line("own share, wake-up to line call", player_all.share_ns);
  line("the same of the bare loop: the machine's", bare_all.share_ns);
  line("step player, total", player_all.late_ns);
  line("bare clock_nanosleep loop, total", bare_all.late_ns);
  fmt::print("  p50 of the player by p50 of the loop: median {:.3f}, worst pair {:.3f}\n",
             ratios[ratios.size() / 2], ratios.back());
  fmt::print("  processor time: player {:.1f} %, loop {:.1f} %\n",
             percent(player_cpu_ns, player_ns), percent(bare_cpu_ns, bare_ns));
  fmt::print("  taken from the processors by the host of this machine: {:.0f} ms in {:.1f} s\n",
             1e3 * bench::StolenSeconds() - stolen_ms,
             1e-9 * static_cast<double>(player_ns + bare_ns));
  std::fflush(stdout);
  return {};
}

Status Bench(const Options& options) {
  SetLogLevel(LogLevel::warning);
  RealTimeGrant grant;
  std::thread([&] { grant = BecomeRealTime({}); }).join();
  fmt::print("SCHED_FIFO {}, locked memory {}\n", grant.fifo ? "granted" : "REFUSED",
             grant.memory_locked ? "granted" : "REFUSED");
  Player player(options);
  SCAN_CHECK(player.Start());
  SCAN_CHECK(Measure(options, player, "idle"));
  const Burners burners(std::thread::hardware_concurrency());
  return Measure(options, player, "every core loaded");
}

}  // namespace
}  // namespace scan

int main(int argc, char** argv) {
  scan::Options options;
  CLI::App app("bench_step_timing: how late steps are on this machine");
  app.add_option("--pairs", options.pairs, "player and bare loop in turn")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  app.add_option("--seconds", options.seconds, "of each half of a pair")
      ->capture_default_str()
      ->check(CLI::Range(0.05, 60.0));
  app.add_option("--rate", options.rate, "steps a second")
      ->capture_default_str()
      ->check(CLI::Range(300, 20000));
  CLI11_PARSE(app, argc, argv);
  if (const scan::Status done = scan::Bench(options); !done) {
    fmt::print(stderr, "bench_step_timing: {}\n", ToString(done.error()));
    return 1;
  }
  return 0;
}
