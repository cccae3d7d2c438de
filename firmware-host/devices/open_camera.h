// The real camera that a station file names.
#pragma once

#include <memory>

#include "drivers/base/clock.h"
#include "drivers/base/result.h"
#include "drivers/camera/camera.h"
#include "drivers/station/station_config.h"

namespace scan {

// Opens it, sets it up and sets exposure and gain of the configuration.
// Precondition: `config.driver` is not sim (the simulated station makes its own cameras).
// Errors: device; bad_input for what the camera cannot do.
Result<std::unique_ptr<Camera>> OpenCamera(const CameraConfig& config,
                                           std::shared_ptr<Clock> clock);

}  // namespace scan
