// How far estimated poses are from the truth.
#pragma once

#include <span>
#include <vector>

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "reconstruction/mesh/mesh.h"

namespace scan {

struct PoseOf {
  CameraFromModel camera_from_model;
  Intrinsics intrinsics;
};

struct PoseError {
  double centre_mm = 0;     // between the camera centres, model frame
  double rotation_rad = 0;  // angle between the rotations
  // Between the pictures of the truly visible surface points at the true and at the estimated pose,
  // each with its own intrinsics; full-size px.
  double surface_median_px = 0, surface_rms_px = 0, surface_p95_px = 0, surface_max_px = 0;
};

// `mesh` is the true surface in the model frame. A point that the estimate puts behind the camera
// counts as the picture's diagonal. Thread contract: pure.
PoseError ScorePose(const TriangleMesh& mesh, const PoseOf& truth, const PoseOf& estimate);

struct Spread {
  double median = 0, p95 = 0, max = 0;
};
// Of a list of errors; zeros for an empty one.
Spread SpreadOf(std::vector<double> values);

}  // namespace scan
