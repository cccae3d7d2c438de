// Depth and face ids of a mesh seen by a camera.
#pragma once

#include <opencv2/core.hpp>

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "reconstruction/mesh/mesh.h"

namespace scan {

struct Raster {
  cv::Mat depth_mm;  // CV_32F, camera z; +inf where nothing is seen
  cv::Mat face;      // CV_32S, index into mesh.faces; -1 where nothing is seen
};

// Renders at the size of `intrinsics`, sampled at pixel centres, lens distortion applied to the
// vertices, both sides of every face, clipped at z > 0. Exact edges in 2^-12 px with the top-left
// rule: no sample is missed or shared between faces that meet at an edge. Faces with a corner where
// the distortion folds over are left out. Same bytes for any number of threads.
// Precondition: every index is below vertices.size(); the longest side is at most 16384.
// Thread contract: pure; parallel inside.
Raster Rasterise(const TriangleMesh& mesh, const CameraFromModel& camera_from_model,
                 const Intrinsics& intrinsics);

// Only what is covered: CV_8U, 0 or 255.
cv::Mat RasteriseMask(const TriangleMesh& mesh, const CameraFromModel& camera_from_model,
                      const Intrinsics& intrinsics);

// Anti-aliased coverage: CV_8U, 0..255, from `samples`^2 points of a lattice per pixel (an edge
// along a row or a column is resolved to 1 / samples^2). Precondition: 1 <= samples <= 15.
cv::Mat RasteriseCoverage(const TriangleMesh& mesh, const CameraFromModel& camera_from_model,
                          const Intrinsics& intrinsics, int samples);

}  // namespace scan
