// libgpiod 2, as in Debian 13.
#include <gpiod.h>

#include <algorithm>
#include <cerrno>

#include "drivers/io/gpio/chip_files.h"
#include "drivers/io/gpio/gpiod_chip.h"
#include "drivers/io/gpio/gpiod_lines.h"

namespace scan {
namespace {

template <class T, void (*free)(T*)>
struct Free {
  void operator()(T* object) const { free(object); }
};
template <class T, void (*free)(T*)>
using Handle = std::unique_ptr<T, Free<T, free>>;
using ChipHandle = Handle<gpiod_chip, gpiod_chip_close>;
using RequestHandle = Handle<gpiod_line_request, gpiod_line_request_release>;
using EventBuffer = Handle<gpiod_edge_event_buffer, gpiod_edge_event_buffer_free>;

std::string TextOf(const char* text) { return text ? text : ""; }

GpioChipInfo Describe(gpiod_chip* chip, const std::string& path) {
  const Handle<gpiod_chip_info, gpiod_chip_info_free> of_chip{gpiod_chip_get_info(chip)};
  GpioChipInfo info{path, of_chip ? TextOf(gpiod_chip_info_get_label(of_chip.get())) : "", {}};
  const std::size_t count = of_chip ? gpiod_chip_info_get_num_lines(of_chip.get()) : 0;
  for (unsigned k = 0; k < count; ++k) {
    const Handle<gpiod_line_info, gpiod_line_info_free> line{gpiod_chip_get_line_info(chip, k)};
    info.lines.push_back(line ? GpioLineInfo{TextOf(gpiod_line_info_get_name(line.get())),
                                             TextOf(gpiod_line_info_get_consumer(line.get())),
                                             gpiod_line_info_is_used(line.get())}
                              : GpioLineInfo{});
  }
  return info;
}

bool Configure(const GpioLineConfig& line, gpiod_line_settings* settings) {
  bool done =
      gpiod_line_settings_set_direction(
          settings, line.output ? GPIOD_LINE_DIRECTION_OUTPUT : GPIOD_LINE_DIRECTION_INPUT) == 0;
  gpiod_line_settings_set_active_low(settings, line.active_low);
  if (line.output) {
    done = done &&
           gpiod_line_settings_set_output_value(
               settings, line.initial ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE) == 0;
    return done;
  }
  if (line.bias != GpioBias::as_is) {
    done = done && gpiod_line_settings_set_bias(settings, line.bias == GpioBias::pull_up
                                                              ? GPIOD_LINE_BIAS_PULL_UP
                                                              : GPIOD_LINE_BIAS_PULL_DOWN) == 0;
  }
  if (line.edges) {
    done = done && gpiod_line_settings_set_edge_detection(settings, GPIOD_LINE_EDGE_BOTH) == 0 &&
           gpiod_line_settings_set_event_clock(settings, GPIOD_LINE_CLOCK_MONOTONIC) == 0;
  }
  return done;
}

class Gpiod2Lines final : public GpioLines {
 public:
  Gpiod2Lines(GpioRequest request, std::string label, std::vector<unsigned> offsets)
      : request_(std::move(request)), label_(std::move(label)), offsets_(std::move(offsets)) {}

  // errno on failure.
  bool Take(gpiod_chip* chip) {
    const Handle<gpiod_line_config, gpiod_line_config_free> config{gpiod_line_config_new()};
    const Handle<gpiod_request_config, gpiod_request_config_free> options{
        gpiod_request_config_new()};
    events_.reset(gpiod_edge_event_buffer_new(1));
    if (!config || !options || !events_) return false;
    gpiod_request_config_set_consumer(options.get(), request_.consumer.c_str());
    for (std::size_t k = 0; k < offsets_.size(); ++k) {
      const Handle<gpiod_line_settings, gpiod_line_settings_free> settings{
          gpiod_line_settings_new()};
      if (!settings || !Configure(request_.lines[k], settings.get())) return false;
      if (gpiod_line_config_add_line_settings(config.get(), &offsets_[k], 1, settings.get()) != 0) {
        return false;
      }
    }
    lines_.reset(gpiod_chip_request_lines(chip, options.get(), config.get()));
    set_offsets_.reserve(offsets_.size());
    set_values_.reserve(offsets_.size());
    return lines_ != nullptr;
  }

  std::size_t size() const override { return offsets_.size(); }

  Status Set(std::span<const GpioLevel> levels) override {
    set_offsets_.clear();
    set_values_.clear();
    for (const GpioLevel& level : levels) {
      set_offsets_.push_back(offsets_[level.line]);
      set_values_.push_back(level.active ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE);
    }
    if (gpiod_line_request_set_values_subset(lines_.get(), levels.size(), set_offsets_.data(),
                                             set_values_.data()) == 0) {
      return {};
    }
    return Fault("cannot set", levels.empty() ? 0 : levels[0].line);
  }

  Result<bool> Get(std::size_t line) override {
    const gpiod_line_value value = gpiod_line_request_get_value(lines_.get(), offsets_[line]);
    if (value == GPIOD_LINE_VALUE_ERROR) return Fault("cannot read", line);
    return value == GPIOD_LINE_VALUE_ACTIVE;
  }

  Result<std::optional<GpioEdge>> WaitEdge(std::int64_t timeout_ns, int stop_fd) override {
    std::vector<pollfd> fds{{gpiod_line_request_get_fd(lines_.get()), POLLIN, 0}};
    if (stop_fd >= 0) fds.push_back({stop_fd, POLLIN, 0});
    if (!PollUntil(fds, timeout_ns)) return Fault("cannot wait for", 0);
    if (fds[0].revents == 0) return std::nullopt;
    if (gpiod_line_request_read_edge_events(lines_.get(), events_.get(), 1) != 1) {
      return Fault("cannot read an edge of", 0);
    }
    gpiod_edge_event* event = gpiod_edge_event_buffer_get_event(events_.get(), 0);
    const unsigned offset = gpiod_edge_event_get_line_offset(event);
    const auto at = std::find(offsets_.begin(), offsets_.end(), offset);
    return GpioEdge{static_cast<std::size_t>(at - offsets_.begin()),
                    gpiod_edge_event_get_event_type(event) == GPIOD_EDGE_EVENT_RISING_EDGE,
                    static_cast<std::int64_t>(gpiod_edge_event_get_timestamp_ns(event))};
  }

 private:
  tl::unexpected<Error> Fault(const char* what, std::size_t line) const {
    return GpiodLineFault(what, label_, request_.lines[line].name);
  }

  GpioRequest request_;
  std::string label_;
  std::vector<unsigned> offsets_;
  RequestHandle lines_;
  EventBuffer events_;
  std::vector<unsigned> set_offsets_;
  std::vector<gpiod_line_value> set_values_;
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
  auto lines = std::make_unique<Gpiod2Lines>(request, info.label,
                                             std::vector<unsigned>(offsets.begin(), offsets.end()));
  const ChipHandle chip{gpiod_chip_open(info.path.c_str())};
  if (!chip || !lines->Take(chip.get())) return tl::unexpected(errno);
  return lines;
}

std::string GpiodVersion() { return gpiod_api_version(); }

}  // namespace scan
