#include "firmware-host/cli/terminal_progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <mutex>
#include <string>

namespace scan {
namespace {

using SteadyClock = std::chrono::steady_clock;

struct Line {
  std::mutex mutex;
  std::string stage;
  SteadyClock::time_point stage_start = SteadyClock::now();
  SteadyClock::time_point last_print{};
};

std::string Remaining(double elapsed_s, double done) {
  if (done <= 0.01) return "";
  return fmt::format(", {:.0f} s left", elapsed_s * (1 - done) / done);
}

}  // namespace

ProgressFn MakeTerminalProgress() {
  if (!::isatty(STDERR_FILENO)) return {};
  auto line = std::make_shared<Line>();
  return [line](std::string_view stage, double done) {
    const std::lock_guard lock(line->mutex);
    const auto now = SteadyClock::now();
    if (line->stage != stage) {
      if (!line->stage.empty()) std::fputc('\n', stderr);
      line->stage = stage;
      line->stage_start = now;
    } else if (now - line->last_print < std::chrono::milliseconds(100) && done < 1) {
      return;
    }
    line->last_print = now;
    const double elapsed_s = std::chrono::duration<double>(now - line->stage_start).count();
    const double share = std::clamp(done, 0.0, 1.0);
    fmt::print(stderr, "\r\x1b[K{:<28} {:3.0f} %  {:.1f} s{}", line->stage, 100 * share, elapsed_s,
               share < 1 ? Remaining(elapsed_s, share) : "");
    std::fflush(stderr);
  };
}

void EndTerminalProgress() {
  if (::isatty(STDERR_FILENO)) std::fputc('\n', stderr);
}

}  // namespace scan
