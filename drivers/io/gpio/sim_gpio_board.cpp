#include "drivers/io/gpio/sim_gpio_board.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <deque>

#include "drivers/base/unique_fd.h"
#include "drivers/io/gpio/chip_files.h"

namespace scan {
namespace {

constexpr std::size_t kEventsALine = 16;  // as in the kernel

}  // namespace

class SimGpioLines final : public GpioLines {
 public:
  SimGpioLines(std::shared_ptr<SimGpioBoard> board, GpioRequest request,
               std::vector<unsigned> offsets)
      : board_(std::move(board)),
        request_(std::move(request)),
        offsets_(std::move(offsets)),
        ready_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK | EFD_SEMAPHORE)) {
    assert(ready_);
    for (std::size_t k = 0; k < offsets_.size(); ++k) {
      const GpioLineConfig& config = request_.lines[k];
      SimGpioBoard::Line& line = At(k);
      line.used = true;
      line.consumer = request_.consumer;
      line.output = config.output;
      if (config.bias != GpioBias::as_is) line.pull = config.bias == GpioBias::pull_up;
      board_->Change(line, config.output ? config.initial != config.active_low : line.pull);
      if (!config.edges) continue;
      line.edges_to = this;
      line.place = k;
    }
  }

  ~SimGpioLines() override {
    std::lock_guard lock(board_->mutex_);
    for (std::size_t k = 0; k < offsets_.size(); ++k) {
      SimGpioBoard::Line& line = At(k);
      line.used = line.output = false;
      line.consumer.clear();
      line.edges_to = nullptr;
      if (board_->after_exit_ == GpioAfterExit::released) board_->Change(line, line.pull);
    }
  }

  std::size_t size() const override { return offsets_.size(); }

  Status Set(std::span<const GpioLevel> levels) override {
    std::lock_guard lock(board_->mutex_);
    if (board_->Fails()) return Fault(levels.empty() ? 0 : levels[0].line);
    for (const GpioLevel& level : levels) {
      assert(request_.lines[level.line].output);
      board_->Change(At(level.line), level.active != request_.lines[level.line].active_low);
    }
    return {};
  }

  Result<bool> Get(std::size_t line) override {
    std::lock_guard lock(board_->mutex_);
    if (board_->Fails()) return Fault(line);
    return At(line).high != request_.lines[line].active_low;
  }

  Result<std::optional<GpioEdge>> WaitEdge(std::int64_t timeout_ns, int stop_fd) override {
    std::vector<pollfd> fds{{ready_.get(), POLLIN, 0}};
    if (stop_fd >= 0) fds.push_back({stop_fd, POLLIN, 0});
    if (!PollUntil(fds, timeout_ns)) return Fault(0);
    if (fds[0].revents == 0) return std::nullopt;
    eventfd_t count = 0;
    eventfd_read(ready_.get(), &count);
    std::lock_guard lock(board_->mutex_);
    if (edges_.empty()) return std::nullopt;
    const GpioEdge edge = edges_.front();
    edges_.pop_front();
    return edge;
  }

  // With the board's lock.
  void OnEdge(std::size_t line, bool high) {
    if (edges_.size() >= kEventsALine * offsets_.size()) return;
    edges_.push_back(
        {line, high != request_.lines[line].active_low, board_->clock_->Now().mono_ns});
    eventfd_write(ready_.get(), 1);
  }

 private:
  SimGpioBoard::Line& At(std::size_t line) { return board_->lines_[offsets_[line]]; }
  tl::unexpected<Error> Fault(std::size_t line) const {
    return DeviceFault("simulated fault of the line",
                       fmt::format("gpio {}/{}", board_->label_, request_.lines[line].name),
                       "start again");
  }

  std::shared_ptr<SimGpioBoard> board_;
  GpioRequest request_;
  std::vector<unsigned> offsets_;
  UniqueFd ready_;
  std::deque<GpioEdge> edges_;
};

SimGpioBoard::SimGpioBoard(std::string label, const std::vector<std::string>& names,
                           std::shared_ptr<Clock> clock, GpioAfterExit after_exit)
    : label_(std::move(label)), clock_(std::move(clock)), after_exit_(after_exit) {
  for (const std::string& name : names) {
    Line line;
    line.name = name;
    lines_.push_back(std::move(line));
  }
}

Result<std::unique_ptr<GpioLines>> SimGpioBoard::Open(const GpioRequest& request) {
  std::lock_guard lock(mutex_);
  GpioChipInfo info{"/dev/gpiochip0", label_, {}};
  for (const Line& line : lines_) info.lines.push_back({line.name, line.consumer, line.used});
  SCAN_TRY(const GpioPlace place, FindGpioLines(std::span(&info, 1), request));
  for (const unsigned offset : place.offsets) {
    if (lines_[offset].used) {
      return tl::unexpected(GpioRequestError(info, request, place.offsets, EBUSY));
    }
  }
  return std::make_unique<SimGpioLines>(shared_from_this(), request, place.offsets);
}

GpioOpener SimGpioBoard::Opener() {
  return [board = shared_from_this()](const GpioRequest& request) { return board->Open(request); };
}

void SimGpioBoard::Listen(Listener listener) {
  std::lock_guard lock(mutex_);
  listener_ = std::move(listener);
}

void SimGpioBoard::Drive(std::string_view name, bool high) {
  std::lock_guard lock(mutex_);
  Line& line = lines_[Find(name)];
  line.pull = high;
  if (!line.output) Change(line, high);
}

bool SimGpioBoard::Level(std::string_view name) const {
  std::lock_guard lock(mutex_);
  return lines_[Find(name)].high;
}

void SimGpioBoard::FailAt(std::int64_t nth) {
  std::lock_guard lock(mutex_);
  operations_ = 0;
  fail_at_ = nth;
}

std::size_t SimGpioBoard::Find(std::string_view name) const {
  const auto found = std::find_if(lines_.begin(), lines_.end(),
                                  [&](const Line& line) { return line.name == name; });
  assert(found != lines_.end());
  return static_cast<std::size_t>(found - lines_.begin());
}

void SimGpioBoard::Change(Line& line, bool high) {
  const bool changed = line.high != high;
  line.high = high;
  if (line.output && listener_) listener_(static_cast<unsigned>(&line - lines_.data()), high);
  if (changed && line.edges_to) line.edges_to->OnEdge(line.place, high);
}

bool SimGpioBoard::Fails() { return fail_at_ > 0 && ++operations_ >= fail_at_; }

}  // namespace scan
