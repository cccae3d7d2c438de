// The GPIO lines' simulated twin: a board of named lines, seen from both sides.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/base/clock.h"
#include "drivers/io/gpio/gpio_lines.h"

namespace scan {

// What lines do when their owner goes: a kernel releases them to their pull, or keeps driving them.
enum class GpioAfterExit { released, kept };

// Outside levels are electrical. Thread contract: any thread.
class SimGpioBoard : public std::enable_shared_from_this<SimGpioBoard> {
 public:
  // Told of every level that a program sets, as it is set; must not call the board.
  using Listener = std::function<void(unsigned line, bool high)>;

  SimGpioBoard(std::string label, const std::vector<std::string>& names,
               std::shared_ptr<Clock> clock, GpioAfterExit after_exit = GpioAfterExit::released);

  // Takes lines; the board lives as long as they do. Precondition: made by std::make_shared.
  Result<std::unique_ptr<GpioLines>> Open(const GpioRequest& request);
  GpioOpener Opener();

  void Listen(Listener listener);
  // From outside; only an input, or a line that nobody holds, follows.
  void Drive(std::string_view name, bool high);
  bool Level(std::string_view name) const;
  // The N-th set or read from now on answers with a device fault, and all after it; 0: none.
  void FailAt(std::int64_t nth);

 private:
  friend class SimGpioLines;
  struct Line {
    std::string name;
    std::string consumer;
    bool used = false, output = false, pull = false, high = false;
    class SimGpioLines* edges_to = nullptr;
    std::size_t place = 0;  // in that request
  };
  std::size_t Find(std::string_view name) const;
  void Change(Line& line, bool high);
  bool Fails();

  const std::string label_;
  const std::shared_ptr<Clock> clock_;
  const GpioAfterExit after_exit_;
  mutable std::mutex mutex_;
  std::vector<Line> lines_;
  Listener listener_;
  std::int64_t operations_ = 0, fail_at_ = 0;
};

}  // namespace scan
