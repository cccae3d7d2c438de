// libgpiod 1.6, as in Debian 12.
#include <gpiod.h>

#include <cassert>
#include <cerrno>

#include "drivers/io/gpio/chip_files.h"
#include "drivers/io/gpio/gpiod_chip.h"
#include "drivers/io/gpio/gpiod_lines.h"

namespace scan {
namespace {

struct CloseChip {
  void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }
};
using ChipHandle = std::unique_ptr<gpiod_chip, CloseChip>;

std::string TextOf(const char* text) { return text ? text : ""; }

GpioChipInfo Describe(gpiod_chip* chip, const std::string& path) {
  GpioChipInfo info{path, TextOf(gpiod_chip_label(chip)), {}};
  for (unsigned k = 0; k < gpiod_chip_num_lines(chip); ++k) {
    gpiod_line* line = gpiod_chip_get_line(chip, k);
    info.lines.push_back(line ? GpioLineInfo{TextOf(gpiod_line_name(line)),
                                             TextOf(gpiod_line_consumer(line)),
                                             gpiod_line_is_used(line)}
                              : GpioLineInfo{});
  }
  return info;
}

// Outputs are one request, so that they change together. Inputs are one each: here a line that
// sends events has a descriptor of its own.
class Gpiod1Lines final : public GpioLines {
 public:
  Gpiod1Lines(GpioRequest request, std::string label)
      : request_(std::move(request)), label_(std::move(label)) {}

  // errno on failure.
  bool Take(ChipHandle chip, std::span<const unsigned> offsets) {
    chip_ = std::move(chip);
    gpiod_line_bulk_init(&bulk_);
    for (const unsigned offset : offsets) {
      gpiod_line* line = gpiod_chip_get_line(chip_.get(), offset);
      if (!line) return false;
      gpiod_line_bulk_add(&bulk_, line);
    }
    return request_.lines.front().output ? TakeOutputs() : TakeInputs();
  }

  std::size_t size() const override { return request_.lines.size(); }

  Status Set(std::span<const GpioLevel> levels) override {
    for (const GpioLevel& level : levels) {
      values_[level.line] = level.active != request_.lines[level.line].active_low;
    }
    if (gpiod_line_set_value_bulk(&bulk_, values_.data()) == 0) return {};
    return Fault("cannot set", levels.empty() ? 0 : levels[0].line);
  }

  Result<bool> Get(std::size_t line) override {
    if (request_.lines[line].output) return values_[line] != request_.lines[line].active_low;
    const int value = gpiod_line_get_value(bulk_.lines[line]);
    if (value < 0) return Fault("cannot read", line);
    return (value != 0) != request_.lines[line].active_low;
  }

  Result<std::optional<GpioEdge>> WaitEdge(std::int64_t timeout_ns, int stop_fd) override {
    std::vector<pollfd> fds;
    std::vector<std::size_t> lines;
    for (std::size_t k = 0; k < size(); ++k) {
      if (!request_.lines[k].edges) continue;
      fds.push_back({gpiod_line_event_get_fd(bulk_.lines[k]), POLLIN, 0});
      lines.push_back(k);
    }
    assert(!lines.empty());
    if (stop_fd >= 0) fds.push_back({stop_fd, POLLIN, 0});
    if (!PollUntil(fds, timeout_ns)) return Fault("cannot wait for", lines[0]);
    for (std::size_t k = 0; k < lines.size(); ++k) {
      if (fds[k].revents != 0) return ReadEdge(lines[k]);
    }
    return std::nullopt;
  }

 private:
  bool TakeOutputs() {
    for (const GpioLineConfig& line : request_.lines) {
      values_.push_back(line.initial != line.active_low);
    }
    return gpiod_line_request_bulk_output(&bulk_, request_.consumer.c_str(), values_.data()) == 0;
  }

  bool TakeInputs() {
    for (std::size_t k = 0; k < size(); ++k) {
      const GpioLineConfig& line = request_.lines[k];
      const int flags = line.bias == GpioBias::pull_up     ? GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP
                        : line.bias == GpioBias::pull_down ? GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN
                                                           : 0;
      const char* consumer = request_.consumer.c_str();
      const int taken =
          line.edges ? gpiod_line_request_both_edges_events_flags(bulk_.lines[k], consumer, flags)
                     : gpiod_line_request_input_flags(bulk_.lines[k], consumer, flags);
      if (taken != 0) return false;
    }
    return true;
  }

  Result<std::optional<GpioEdge>> ReadEdge(std::size_t line) {
    gpiod_line_event event{};
    if (gpiod_line_event_read(bulk_.lines[line], &event) != 0) {
      return Fault("cannot read an edge of", line);
    }
    const bool high = event.event_type == GPIOD_LINE_EVENT_RISING_EDGE;
    return GpioEdge{line, high != request_.lines[line].active_low,
                    std::int64_t{event.ts.tv_sec} * 1'000'000'000 + event.ts.tv_nsec};
  }

  tl::unexpected<Error> Fault(const char* what, std::size_t line) const {
    return GpiodLineFault(what, label_, request_.lines[line].name);
  }

  GpioRequest request_;
  std::string label_;
  ChipHandle chip_;  // releases the lines
  gpiod_line_bulk bulk_{};
  std::vector<int> values_;  // electrical
};

}  // namespace

std::optional<GpioChipInfo> DescribeGpiodChip(const std::string& path) {
  const ChipHandle chip{gpiod_chip_open(path.c_str())};
  if (!chip) return std::nullopt;
  return Describe(chip.get(), path);
}

tl::expected<std::unique_ptr<GpioLines>, int> TakeGpiodLines(const GpioChipInfo& info,
                                                             const GpioRequest& request,
                                                             std::span<const unsigned> offsets) {
  auto lines = std::make_unique<Gpiod1Lines>(request, info.label);
  ChipHandle chip{gpiod_chip_open(info.path.c_str())};
  if (!chip || !lines->Take(std::move(chip), offsets)) return tl::unexpected(errno);
  return lines;
}

std::string GpiodVersion() { return gpiod_version_string(); }

}  // namespace scan
