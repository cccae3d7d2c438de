// One photograph onto the texels that it truly shows.
#pragma once

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "reconstruction/masks/mask.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/texture/texels.h"

namespace scan {

struct ViewToProject {
  cv::Mat photo;  // CV_8UC3, sRGB BGR, at the size of the intrinsics
  const Mask* mask = nullptr;
  CameraFromModel camera_from_model;
  Intrinsics intrinsics;
  std::uint16_t index = 0;
};

// A texel is measured when it faces the camera within max_incidence, projects at least a pixel and
// a half inside the mask, no surface within that distance lies nearer than its tangent plane, and
// no pixel beside its own shows something behind it: a pixel at an edge is a mixture.
Layer ProjectView(const Texels& texels, const TriangleMesh& mesh, const ViewToProject& view,
                  double max_incidence_rad);

}  // namespace scan
