// The lamp that a station file names.
#pragma once

#include <memory>

#include "drivers/base/result.h"
#include "drivers/io/lamp.h"
#include "drivers/station/station_config.h"

namespace scan {

// Null where the station has none. Errors: device; bad_input for what the chip does not have.
Result<std::unique_ptr<Lamp>> OpenLamp(const StationConfig& config);

}  // namespace scan
