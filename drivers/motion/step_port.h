// The lines of one stepper driver: direction, step, enable, and what its axis' switches say.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "drivers/base/result.h"

namespace scan {

// Thread contract: one thread at a time. Errors: device faults (line gone, board not answering).
class StepPort {
 public:
  virtual ~StepPort() = default;
  // Motor current on or off; without it edges do nothing.
  virtual Status Enable(bool on) = 0;
  // A holding brake, where the axis has one.
  virtual Status Brake(bool on) = 0;
  virtual Status SetDirection(bool positive) = 0;
  // One step now; `deadline_ns` (monotonic) says when it was due.
  virtual Status EmitEdge(std::int64_t deadline_ns) = 0;
  virtual Result<bool> Endstop() = 0;
  virtual Result<bool> Index() = 0;
};

// Puts something between an axis and its port.
using StepPortWrap =
    std::function<std::unique_ptr<StepPort>(const std::string& axis, std::unique_ptr<StepPort>)>;

}  // namespace scan
