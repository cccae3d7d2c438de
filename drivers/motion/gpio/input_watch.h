// The switches of a station: follows their edges as the kernel reports them.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/base/result.h"
#include "drivers/base/unique_fd.h"
#include "drivers/io/gpio/gpio_lines.h"
#include "drivers/motion/gpio/gpio_motion_config.h"

namespace scan {

// A thread of its own waits for edges, so that asking costs the stepping thread one atomic read.
// More than `kMostEdges` edges of an input within `kBounceNs` are a fault of that input until it is
// forgiven: contacts bounce a few times, then rest.
// Thread contract: any thread.
class InputWatch {
 public:
  static constexpr std::size_t kMostEdges = 12;
  static constexpr std::int64_t kBounceNs = 50'000'000;

  struct Input {
    std::string name;  // for people: "lift endstop"
    GpioPin pin;
  };
  // Told of every change, on the watching thread; `active` is also true when the line has failed.
  using Listener = std::function<void(std::size_t input, bool active)>;

  // `priority` of the watching thread (SCHED_FIFO; 0: an ordinary one) stays below that of the
  // thread that steps; where it is not permitted the log says so. Errors: as the opener's.
  static Result<std::unique_ptr<InputWatch>> Start(const GpioOpener& open, const std::string& chip,
                                                   std::vector<Input> inputs, int priority = 0);
  ~InputWatch();

  // Inputs by their place. Errors: device, when it bounces or its line has failed.
  Result<bool> Read(std::size_t input) const;
  void Forgive(std::size_t input);
  // Also told at once of every input that is active now. Precondition: not yet called.
  void Listen(Listener listener);
  // The listener is not told anything once this has returned.
  void Deafen();

 private:
  struct State {
    std::atomic<bool> active{false};
    std::atomic<bool> bounces{false};
    std::array<std::int64_t, kMostEdges> edges_ns{};  // the latest, in turn; of the watching thread
    std::size_t edges = 0;
  };
  InputWatch() = default;
  void Run(std::stop_token stop, int priority);
  void Follow(const GpioEdge& edge);
  Status ReadAgain();
  void Change(std::size_t input, bool active);
  void Tell(std::size_t input, bool active);

  std::vector<Input> inputs_;
  std::unique_ptr<State[]> states_;
  std::unique_ptr<GpioLines> lines_;
  UniqueFd wake_;
  std::atomic<bool> failed_{false};
  std::mutex mutex_;  // guards the listener, and is held while it is told
  Listener listener_;
  std::jthread thread_;  // last: it uses all of the above
};

}  // namespace scan
