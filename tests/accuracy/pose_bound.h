// How exact a pose by its outline can be: the Cramer-Rao bound, by finite differences of rendered
// outlines, without anything of the solver.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "reconstruction/evaluate/contour_noise.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/pose/score.h"

namespace scan::test {

// What the outline of one camera's picture says about its pose, and what the pose moves.
struct OutlineInformation {
  // Sum over the outline of J' J ds, px: rotation about the mass centre (rad), translation (mm),
  // both in the camera frame; mask bias (px).
  Eigen::Matrix<double, 7, 7> outline = Eigen::Matrix<double, 7, 7>::Zero();
  Eigen::Matrix<double, 3, 6> centre;   // d(camera centre) by the pose
  Eigen::Matrix<double, 6, 6> surface;  // mean over visible points of J' J, px^2
  double skipped = 0;  // share of the outline that appears or vanishes as the camera moves: no
                       // evidence here
};
OutlineInformation InformationOf(const TriangleMesh& mesh, const PoseOf& camera);

struct PoseBound {
  double centre_mm = 0;   // root of the trace of the camera centre's covariance
  double surface_px = 0;  // RMS over visible surface points of what ScorePose measures
};

// The noise counts as sigma^2 times its correlation per px of outline; binary masks add 1/12 px^2.
// The mask bias is free within its prior when `bias_sigma_px` is positive, else known.
// Nothing when the outline leaves a direction free.
std::optional<PoseBound> BoundOf(const OutlineInformation& information, const ContourNoise& noise,
                                 double bias_sigma_px);

}  // namespace scan::test
