// Whether an axis may go to a target, whoever makes its ramps.
#pragma once

#include <string>

#include "drivers/base/result.h"
#include "drivers/motion/axis_config.h"
#include "drivers/motion/axis_table.h"

namespace scan {

// `fault`: of the axis, for people. Errors: bad_input for a target that is not a number or outside
// the limits; device where the axis' state accepts no move. Thread contract: pure.
Status CheckAxisTarget(const AxisConfig& config, AxisState state, const std::string& fault,
                       double target);

}  // namespace scan
