// The charts of an atlas for people to look at.
#pragma once

#include <opencv2/core.hpp>

#include "reconstruction/mesh/atlas_mesh.h"

namespace scan {

// The surface from two sides and beside it the square of the texture, `height_px` high, every chart
// in a colour of its own. CV_8UC3 (BGR). Preconditions: at least one face; height_px in [16, 4096].
// Thread contract: pure; same bytes for any number of threads.
cv::Mat ChartPicture(const AtlasMesh& atlas, int height_px = 360);

}  // namespace scan
