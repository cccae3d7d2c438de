// A small fast rasteriser of the covered pixels only, for thousands of small pictures.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <span>

#include "reconstruction/mesh/mesh.h"

namespace scan {

// Sets to 255 every pixel of `mask` (CV_8U) whose centre lies in a triangle of `pixels` (projected
// vertices; NaN where not in front of the camera: such faces are left out). With `closed_edges` a
// pixel is also set when a vertex falls into it, so that parts thinner than a pixel do not vanish.
// Thread contract: pure.
void FillTriangles(std::span<const Eigen::Vector2f> pixels, std::span<const Face> faces,
                   cv::Mat& mask, bool closed_edges = false);

}  // namespace scan
