// Checks that every pose method makes of its input.
#pragma once

#include <span>
#include <string>

#include "acquisition/session/photo_set.h"
#include "drivers/base/result.h"
#include "reconstruction/masks/mask.h"
#include "reconstruction/mesh/mesh.h"

namespace scan {

// Errors: bad_input for a mesh without faces, with indices out of range or with NaN or infinite
// vertices, for no photos, a number of masks or a mask of a size that does not match.
Status CheckPoseInput(const TriangleMesh& mesh, const PhotoSet& photos,
                      std::span<const Mask> masks);

}  // namespace scan
