#include "drivers/motion/gpio/input_watch.h"

#include <fmt/format.h>
#include <sys/eventfd.h>

#include <cassert>

#include "drivers/base/log.h"

namespace scan {

Result<std::unique_ptr<InputWatch>> InputWatch::Start(const GpioOpener& open,
                                                      const std::string& chip,
                                                      std::vector<Input> inputs, int priority) {
  std::unique_ptr<InputWatch> watch(new InputWatch);
  watch->inputs_ = std::move(inputs);
  watch->states_ = std::make_unique<State[]>(watch->inputs_.size());
  if (watch->inputs_.empty()) return watch;
  GpioRequest request{chip, "scanstation inputs", {}};
  for (const Input& input : watch->inputs_) {
    request.lines.push_back(
        {input.pin.name, false, input.pin.active_low, false, input.pin.bias, true});
  }
  SCAN_TRY(watch->lines_, open(request));
  SCAN_CHECK(watch->ReadAgain());
  watch->wake_.Reset(eventfd(0, EFD_CLOEXEC));
  if (!watch->wake_) {
    return Failed("no more descriptors", "gpio inputs", "close other programs");
  }
  watch->thread_ = std::jthread(
      [raw = watch.get(), priority](std::stop_token stop) { raw->Run(stop, priority); });
  return watch;
}

InputWatch::~InputWatch() {
  thread_.request_stop();
  if (wake_) eventfd_write(wake_.get(), 1);
}

Result<bool> InputWatch::Read(std::size_t input) const {
  assert(input < inputs_.size());
  const State& state = states_[input];
  if (failed_) {
    return DeviceFault("the inputs can no longer be read", "gpio inputs",
                       "check the board, then start scanstation-motiond again");
  }
  if (state.bounces) {
    return DeviceFault(fmt::format("{} changed more than {} times within {} ms",
                                   inputs_[input].name, kMostEdges, kBounceNs / 1'000'000),
                       "gpio " + inputs_[input].pin.name,
                       "check the switch for bounce and its wire for noise");
  }
  return state.active.load();
}

void InputWatch::Forgive(std::size_t input) { states_[input].bounces = false; }

void InputWatch::Listen(Listener listener) {
  std::lock_guard lock(mutex_);
  assert(!listener_);
  listener_ = std::move(listener);
  for (std::size_t k = 0; k < inputs_.size(); ++k) {
    if (failed_ || states_[k].active) listener_(k, true);
  }
}

void InputWatch::Deafen() {
  std::lock_guard lock(mutex_);
  listener_ = nullptr;
}

void InputWatch::Run(std::stop_token stop, int priority) {
  const RealTimeGrant grant = BecomeRealTime({priority, std::nullopt});
  if (priority > 0 && !grant.fifo) {
    Log(LogLevel::warning, "inputs_real_time",
        {{"fifo", "no"},
         {"effect", "news of a switch may come late on a busy machine"},
         {"mend", grant.mend}});
  }
  for (;;) {
    auto edge = lines_->WaitEdge(-1, wake_.get());
    if (stop.stop_requested()) return;
    while (edge && *edge) {
      Follow(**edge);
      edge = lines_->WaitEdge(0);
    }
    // The kernel's buffer may have overflowed: what counts is the level now.
    const Status read = edge ? ReadAgain() : Status();
    if (edge && read) continue;
    const Error& error = edge ? read.error() : edge.error();
    Log(LogLevel::error, "inputs_failed", {{"error", ToString(error)}});
    failed_ = true;
    for (std::size_t k = 0; k < inputs_.size(); ++k) Tell(k, true);
    return;
  }
}

void InputWatch::Follow(const GpioEdge& edge) {
  State& state = states_[edge.line];
  std::int64_t& oldest_ns = state.edges_ns[state.edges % kMostEdges];
  if (state.edges >= kMostEdges && edge.mono_ns - oldest_ns < kBounceNs) state.bounces = true;
  oldest_ns = edge.mono_ns;
  ++state.edges;
  Change(edge.line, edge.active);
}

Status InputWatch::ReadAgain() {
  for (std::size_t k = 0; k < inputs_.size(); ++k) {
    SCAN_TRY(const bool active, lines_->Get(k));
    Change(k, active);
  }
  return {};
}

void InputWatch::Change(std::size_t input, bool active) {
  if (states_[input].active.exchange(active) != active) Tell(input, active);
}

void InputWatch::Tell(std::size_t input, bool active) {
  std::lock_guard lock(mutex_);
  if (listener_) listener_(input, active);
}

}  // namespace scan
