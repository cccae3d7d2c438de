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
// vertices, both sides of every face, clipped at z > 0. Same bytes for any number of threads.
// Thread contract: pure; parallel inside.
Raster Rasterise(const TriangleMesh& mesh, const CameraFromModel& camera_from_model,
                 const Intrinsics& intrinsics);

// Only what is covered: CV_8U, 0 or 255.
cv::Mat RasteriseMask(const TriangleMesh& mesh, const CameraFromModel& camera_from_model,
                      const Intrinsics& intrinsics);

// Anti-aliased coverage: CV_8U, 0..255, from `samples` x `samples` per pixel.
cv::Mat RasteriseCoverage(const TriangleMesh& mesh, const CameraFromModel& camera_from_model,
                          const Intrinsics& intrinsics, int samples);

}  // namespace scan
