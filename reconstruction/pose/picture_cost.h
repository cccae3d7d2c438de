// The paper's cost of a pose on a reduced picture.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "reconstruction/masks/mask.h"
#include "reconstruction/mesh/mesh.h"

namespace scan {

// Longest side of the reduced picture: 1/8 of the paper's photographs.
constexpr int kReducedSide = 462;

// A photograph as Eq 3 sees it: area-averaged, binarised at half coverage, aspect kept.
struct ReducedPicture {
  Intrinsics intrinsics;  // of the reduced picture
  cv::Mat mask;           // CV_8U, 0 or 255
  cv::Mat distance_l1;    // CV_32F, city-block, seeded on the mask's inner boundary
  cv::Mat distance_l2;    // CV_32F, Euclidean, same seeds
  bool empty() const { return mask.empty(); }  // no specimen in it
};
// A picture that is no longer than `longest_side` is not enlarged.
ReducedPicture ReducePicture(const Mask& mask, const Intrinsics& intrinsics,
                             int longest_side = kReducedSide);

// Foreground pixels with a 4-neighbour in the background; the picture's border is no background.
std::vector<cv::Point> BoundaryPixels(const cv::Mat& mask);

// What a reduced camera sees of the mesh: CV_8U, 0 or 255.
cv::Mat RenderReduced(const TriangleMesh& mesh, const CameraFromModel& camera_from_model,
                      const Intrinsics& reduced);

struct PictureCost {
  double l1_px = 0, l2_px = 0;
};
// Ijiri 2018, Eq 3: mean of the distance image under the boundary of the rendered mesh. Nothing of
// the mesh in the picture costs the picture's longest side. Precondition: not empty.
// Thread contract: pure.
PictureCost CostOfPose(const ReducedPicture& picture, const TriangleMesh& mesh,
                       const CameraFromModel& camera_from_model);

}  // namespace scan
