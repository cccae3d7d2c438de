// What the silhouettes cannot show: eigen-analysis of the information about a specimen's placing.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "reconstruction/pose/joint_refine.h"
#include "reconstruction/pose/joint_result.h"
#include "reconstruction/pose/poses.h"

namespace scan {

struct ObservabilityOptions {
  double free_px = 1.0;  // a direction is free when its data-only 1 sigma moves the surface by more
                         // than this (RMS, full size)
  int smoothing = 8;     // rounds of averaging of the mesh's normals over neighbours
  // Normals are never trusted finer than this: a rotation that shows only in finer detail than the
  // mesh's own noise is not determined by it.
  double normal_noise_rad = 0.01;
  EvidenceWeights weights;  // sigma_px is taken from each view's fit
};

// Normals of a mesh as the analysis needs them, computed once.
struct SmoothNormals {
  std::vector<Eigen::Vector3d> normals;  // per vertex, averaged over neighbours
  double noise_rad = 0;                  // of `normals`, from what the averaging took away
};
SmoothNormals SmoothNormalsOf(const ContourMesh& mesh, int rounds);

// An axis in the model frame.
struct Screw {
  Eigen::Vector3d axis, point;
};

// The rotation that slides the surface along itself best (Gelfand and Guibas 2004), relative to how
// far it moves the surface in the pictures.
Screw SlippageAxisOf(const ContourMesh& mesh, const SmoothNormals& smooth, const RigModel& rig,
                     const RigParameters& parameters, std::span<const int> views);

// The rotations, translations and scalings of the specimen of one mounting that the contours and
// beads of its views leave free, least determined first.
//
// Body motions x -> Exp(w) (x - c) + c + tau about the mass centre c move a contour point along its
// image normal by n . (w x (p - c) + tau), n the smooth surface normal. The information of all
// matched points and of the beads in the photographs, with focal length, principal point and mask
// bias marginalised under their priors and the part that noise of the normals fakes taken off, is
// compared with the mean square motion of the visible surface in the pictures. `views`: those of
// the mounting that take part. Thread contract: pure.
std::vector<FreeDirection> FreeDirectionsOf(const ContourMesh& mesh, const SmoothNormals& smooth,
                                            const RigModel& rig, const RefineResult& fit,
                                            std::span<const int> views,
                                            const ObservabilityOptions& options);

// Widens the posterior along a free direction to the prior of the placing, whatever the facets and
// the noise of the mesh made the solver believe.
void AddFreedom(const RigModel& rig, const RigParameters& parameters,
                const FreeDirection& direction, RigPosterior& posterior);

// A sentence for the report: what is free and what to do about it.
std::string Sentence(const FreeDirection& direction);

}  // namespace scan
