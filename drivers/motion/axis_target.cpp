#include "drivers/motion/axis_target.h"

#include <fmt/format.h>

#include <cmath>

namespace scan {

Status CheckAxisTarget(const AxisConfig& config, AxisState state, const std::string& fault,
                       double target) {
  if (!std::isfinite(target)) {
    return BadInput("target is not a number", config.name, "give a finite position");
  }
  if ((config.min && target < *config.min) || (config.max && target > *config.max)) {
    return BadInput(fmt::format("target {} {} is outside the limits {} to {} {}", target,
                                config.unit, config.min ? fmt::to_string(*config.min) : "-inf",
                                config.max ? fmt::to_string(*config.max) : "inf", config.unit),
                    config.name, "choose a position within them");
  }
  if (!Accepts(state, AxisCommand::move)) {
    return DeviceFault(
        fmt::format("axis is {}{}{}", Row(state).name, fault.empty() ? "" : ": ", fault),
        config.name, std::string(Row(state).mend));
  }
  return {};
}

}  // namespace scan
