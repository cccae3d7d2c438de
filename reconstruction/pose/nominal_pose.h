// Where the log or the import says a photograph's camera stood.
#pragma once

#include <optional>

#include "acquisition/session/photo_set.h"

namespace scan {

// The photograph's own nominal pose, else that of its aim with its logged turntable and lift;
// nothing when neither is known.
std::optional<CameraFromTable> NominalCameraFromTable(const PhotoSet& photos, const Photo& photo);

}  // namespace scan
