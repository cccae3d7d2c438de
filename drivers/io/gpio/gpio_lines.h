// Digital lines of a GPIO chip, shaped like a line request of libgpiod 2.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/base/result.h"

namespace scan {

enum class GpioBias { as_is, pull_up, pull_down };

// One line of a request. Levels are logical: active is the electrical low where `active_low`.
struct GpioLineConfig {
  std::string name;  // the kernel's name of the line, or its number on the chip ("17")
  bool output = false;
  bool active_low = false;
  bool initial = false;             // outputs: level from the request on
  GpioBias bias = GpioBias::as_is;  // inputs
  bool edges = false;               // inputs: both edges arrive at WaitEdge
  friend bool operator==(const GpioLineConfig&, const GpioLineConfig&) = default;
};

// Lines that are taken together: all outputs or all inputs.
struct GpioRequest {
  std::string chip;      // label ("pinctrl-rp1"); empty: the one chip that has all these names
  std::string consumer;  // who holds them, for people
  std::vector<GpioLineConfig> lines;
};

struct GpioLevel {
  std::size_t line = 0;  // place in the request
  bool active = false;
};

struct GpioEdge {
  std::size_t line = 0;      // place in the request
  bool active = false;       // the level after it
  std::int64_t mono_ns = 0;  // the kernel's, CLOCK_MONOTONIC
  friend bool operator==(const GpioEdge&, const GpioEdge&) = default;
};

// Holds its lines until it is destroyed; what they do then is the kernel's affair: some release
// them to their pull, others keep driving them. Thread contract: Set and Get from any one thread at
// a time; WaitEdge from one thread, beside them. Errors: device faults that name chip and line.
class GpioLines {
 public:
  virtual ~GpioLines() = default;
  virtual std::size_t size() const = 0;
  // Sets these lines in one call; the others keep their level. Precondition: outputs.
  virtual Status Set(std::span<const GpioLevel> levels) = 0;
  virtual Result<bool> Get(std::size_t line) = 0;
  // The next edge; nothing when `timeout_ns` ran out (negative: never) or `stop_fd` (if not -1)
  // became readable. Edges that came before the call are kept, up to the kernel's buffer of 16 a
  // line; edges in quick succession may come as one, with the level after them.
  // Precondition: some line has `edges`.
  virtual Result<std::optional<GpioEdge>> WaitEdge(std::int64_t timeout_ns, int stop_fd = -1) = 0;
};

using GpioOpener = std::function<Result<std::unique_ptr<GpioLines>>(const GpioRequest&)>;

// What a chip has, for people.
struct GpioLineInfo {
  std::string name;
  std::string consumer;  // empty when nobody holds it
  bool used = false;
};
struct GpioChipInfo {
  std::string path;  // "/dev/gpiochip0"
  std::string label;
  std::vector<GpioLineInfo> lines;
};

// Place of a request's lines among chips. Errors: device, when a chip or line is not there or not
// unique, naming what is.
struct GpioPlace {
  std::size_t chip = 0;
  std::vector<unsigned> offsets;
};
Result<GpioPlace> FindGpioLines(std::span<const GpioChipInfo> chips, const GpioRequest& request);

// The error of a request that the kernel refused with `error_number`.
Error GpioRequestError(const GpioChipInfo& chip, const GpioRequest& request,
                       std::span<const unsigned> offsets, int error_number);

}  // namespace scan
