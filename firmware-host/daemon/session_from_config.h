// What a session says of the station that captures it.
#pragma once

#include <string>

#include "acquisition/session/session_document.h"
#include "drivers/base/result.h"
#include "drivers/station/station_config.h"

namespace scan {

// The station's nominal geometry with its stated uncertainties, and the planned views.
// `created_utc_ns` is left to the run. Errors: bad_input for a plan that is out of range.
Result<SessionDocument> MakeSessionDocument(const StationConfig& config, const std::string& id);

// A session id ([a-z0-9-]+) from a folder's name.
std::string SessionIdFrom(const std::string& folder_name);

}  // namespace scan
