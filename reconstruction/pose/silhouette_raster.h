// A small fast rasteriser of the covered pixels only, for thousands of small pictures.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <span>

#include "reconstruction/mesh/mesh.h"

namespace scan {

struct FillOptions {
  // A pixel is also set when a vertex falls into it, so that parts thinner than a pixel do not
  // vanish.
  bool vertices_too = false;
  // Only faces that run clockwise in the picture: of a closed mesh in front of the camera they
  // cover what all faces cover, in half of the time.
  bool one_side = false;
};

// Sets to 255 every pixel of `mask` (CV_8U) whose centre lies in a triangle of `pixels` (projected
// vertices; NaN where not in front of the camera: such faces are left out).
// Thread contract: pure.
void FillTriangles(std::span<const Eigen::Vector2f> pixels, std::span<const Face> faces,
                   cv::Mat& mask, const FillOptions& options = {});

}  // namespace scan
