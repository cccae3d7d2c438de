// What stands low above the platter (stub, pin, base) taken out of the evidence.
#pragma once

#include <vector>

#include "acquisition/session/photo_set.h"
#include "drivers/base/result.h"
#include "reconstruction/masks/mask.h"

namespace scan {

// Adds to each mask's ignore picture every pixel whose ray, from the nominal camera, passes the
// turntable axis below `height_mm` of the table frame. The line across a picture is that of the
// axis, so that a specimen's part nearer to the camera is cut a little higher than one behind.
// Masks without a specimen stay as they are. Precondition: one mask per photo.
// Errors: bad_input for a photograph without a nominal pose or a height that is not finite.
// Thread contract: pure; parallel inside.
Status ExcludeBelow(const PhotoSet& photos, double height_mm, std::vector<Mask>& masks);

}  // namespace scan
