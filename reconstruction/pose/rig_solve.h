// The joint problem: condensed contour evidence of all views and the priors of the rig.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "reconstruction/pose/contour_evidence.h"
#include "reconstruction/pose/rig_model.h"

namespace scan {

// Places of the parameters in one vector: shared ones first, then each view's own eight.
struct RigLayout {
  explicit RigLayout(const RigModel& rig);
  int mounting(int i) const { return 6 * i; }
  int epoch(int i) const { return epochs_ + i; }
  int aim(int i) const { return aims_ + 6 * i; }
  int axis() const { return axis_; }
  int lens(int i) const { return lenses_ + kLensSize * i; }
  int mask_bias() const { return bias_; }
  int ct_scale() const { return bias_ + 1; }
  int view(int i) const { return views_ + 8 * i; }
  int size = 0;

 private:
  int epochs_ = 0, aims_ = 0, axis_ = 0, lenses_ = 0, bias_ = 0, views_ = 0;
};

// One standard deviation of every parameter's prior, in the order of the layout.
Eigen::VectorXd PriorSigmas(const RigModel& rig, const RigLayout& layout);

// Moves `parameters` to the minimum of  1/2 sum (x / sigma)^2 + sum of the views' quadratic forms.
// Lens parameters that the rig holds stay at their nominal value.
// Views without evidence are held by their priors alone. Ceres with one thread: bit-stable; the
// parallel work is in the condensation before.
// Returns the cost at the minimum. Thread contract: pure.
double SolveRig(const RigModel& rig, std::span<const std::optional<CondensedEvidence>> evidence,
                RigParameters& parameters);

// Derivative of (motion of the camera_from_model about `pivot` in the camera frame, log focal,
// principal point, bias, distortion) of a view by all parameters, at `parameters`: kEvidenceSize x
// layout.size.
Eigen::MatrixXd ViewJacobian(const RigModel& rig, const RigLayout& layout,
                             const RigParameters& parameters, int view,
                             const Eigen::Vector3d& pivot);

// Information (inverse covariance) of all parameters: priors and evidence, at `parameters`.
Eigen::MatrixXd RigInformation(const RigModel& rig, const RigLayout& layout,
                               std::span<const std::optional<CondensedEvidence>> evidence,
                               const RigParameters& parameters);

}  // namespace scan
