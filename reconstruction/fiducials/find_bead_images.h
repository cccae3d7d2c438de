// Beads in photographs, by their colour.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string_view>
#include <vector>

#include "drivers/base/result.h"
#include "reconstruction/fiducials/bead.h"

namespace scan {

// Linear-light RGB of "#rrggbb" (sRGB). Errors: bad_input for another form, or for a grey, which
// tells no bead from light and shade.
Result<Eigen::Vector3d> ParseBeadColour(std::string_view text);

struct BeadColourOptions {
  Eigen::Vector3d colour = Eigen::Vector3d::UnitZ();  // linear-light RGB, any brightness
  double tolerance = 0.15;   // largest distance in chromaticity (r, g, b) / (r + g + b)
  double darkest = 0.02;     // least mean of linear r, g, b: in the dark colour is noise
  double least_area_px = 6;  // smaller patches are left out
};

// The patches of the colour with their centroids to a fraction of a pixel: what lies inside a patch
// counts whole, highlights too; of the pixels about its edge the share that is bead, told from the
// colours inside and outside of it there. In the order of their first pixel, row by row.
// Precondition: `picture` is CV_8UC3, BGR, sRGB. Thread contract: pure.
std::vector<BeadImage> FindBeadImages(const cv::Mat& picture, const BeadColourOptions& options);

}  // namespace scan
