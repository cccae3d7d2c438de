// What silhouettes with known cameras leave of space.
#pragma once

#include <Eigen/Geometry>
#include <span>

#include "drivers/base/result.h"
#include "reconstruction/evaluate/pose_trial.h"

namespace scan::test {

struct HullView {
  const Mask* mask;
  PoseOf camera;
};

// Surface of the visual hull within `box_mm`, model frame: the zero of the least signed distance,
// in px, of a point's image to the silhouettes' outlines. What is outside of a picture is
// background; masks' ignored regions are not looked at. Errors: those of ExtractSurface. Thread
// contract: pure; parallel inside, the same bytes for any number of threads.
Result<TriangleMesh> VisualHull(std::span<const HullView> views, const Eigen::AlignedBox3d& box_mm,
                                double voxel_mm);

}  // namespace scan::test
