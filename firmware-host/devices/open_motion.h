// The motion that a station file names.
#pragma once

#include <memory>

#include "drivers/base/result.h"
#include "drivers/motion/motion.h"
#include "drivers/station/station_config.h"

namespace scan {

// Opens what moves the axes: simulated, on GPIO lines or on Tic boards, each with the clock it
// needs. Errors: device; bad_input for what the devices cannot do.
Result<std::unique_ptr<Motion>> OpenMotion(const StationConfig& config);

}  // namespace scan
