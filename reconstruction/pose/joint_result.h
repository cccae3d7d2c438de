// From a solved rig to what is reported: poses, covariances, shared estimates.
#pragma once

#include <Eigen/Core>

#include "acquisition/session/photo_set.h"
#include "reconstruction/pose/joint_refine.h"
#include "reconstruction/pose/poses.h"
#include "reconstruction/pose/rig_solve.h"

namespace scan {

// The posterior of all parameters, priors included.
struct RigPosterior {
  RigLayout layout;
  Eigen::VectorXd prior_sigma;
  Eigen::MatrixXd covariance;
};
RigPosterior PosteriorOf(const RigModel& rig, const RefineResult& fit);

// Marginal covariance of (w, rho) about the camera centre, log focal, principal point, bias.
EvidenceMatrix ViewCovariance(const RigModel& rig, const RigPosterior& posterior,
                              const RigParameters& parameters, int view);

// Standard deviation of the picture of visible surface points, the root of the trace of its 2 x 2
// covariance, with all cross-correlations to the intrinsics.
SurfaceSigma SurfaceSigmaOf(const ContourMesh& mesh, const CameraFromModel& camera_from_model,
                            const Intrinsics& intrinsics, const EvidenceMatrix& covariance);

// Everything that is shared: lens states, nuisances, mountings, axes.
void DescribeShared(const PhotoSet& photos, const RigModel& rig, const RigPosterior& posterior,
                    const RigParameters& parameters, Poses& poses);

}  // namespace scan
