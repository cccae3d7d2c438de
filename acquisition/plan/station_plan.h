// The documents of a session that follow from a station's configuration.
#pragma once

#include <string>
#include <vector>

#include "acquisition/session/session_document.h"
#include "drivers/base/result.h"
#include "drivers/station/station_config.h"

namespace scan {

// Axes, lift, and every camera with its nominal lens and one camera_from_lift an aim.
// Precondition: the configuration is valid. Thread contract: pure.
StationDocument DescribeStation(const StationConfig& config);

// The views of the configured rings: each at the lift height of its aim, by every camera.
// Errors: bad_input for a ring out of range. Thread contract: pure.
Result<std::vector<PlannedView>> PlanOfStation(const StationConfig& config);

}  // namespace scan
