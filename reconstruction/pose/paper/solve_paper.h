// Camera positions as Ijiri et al. 2018 estimate them: each photograph alone, by its silhouette.
// The baseline that the joint solve is measured against.
#pragma once

#include <cstdint>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "reconstruction/masks/mask.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/pose/paper/paper_camera.h"
#include "reconstruction/pose/picture_cost.h"
#include "reconstruction/pose/poses.h"

namespace scan {

struct PaperOptions {
  std::string model;     // the mesh file's name, for the result
  int subdivisions = 4;  // of the icosphere of directions: 4 gives the paper's 2,562
  std::vector<double> distance_offsets_mm{0, -10, 10, -20, 20, -30, 30};
  int angle_step_deg = 1;
  int descent_steps = 100;  // at most; ends when the line search finds nothing better
  int chains = 12;          // of hill climbing, each from the same start
  int hill_steps = 1000;
  double gate_px = 0.7;  // on the city-block cost of Eq 3
  int longest_side = kReducedSide;
  std::uint64_t seed = 1;
};

// Ijiri 2018, Eq 6: descent with central differences and line search from `start`.
PaperCamera DescendPaper(const ReducedPicture& picture, const TriangleMesh& mesh,
                         const Eigen::Vector3d& mass_centre, const PaperCamera& start,
                         const PaperOptions& options, std::stop_token stop = {});

// Random walk that keeps what is better; the best of all chains. Parallel over the chains, same
// result for any number of threads.
PaperCamera ClimbPaper(const ReducedPicture& picture, const TriangleMesh& mesh,
                       const Eigen::Vector3d& mass_centre, const PaperCamera& start,
                       const PaperOptions& options, std::uint64_t seed, std::stop_token stop = {});

// Finds camera_from_model of every photograph from its own silhouette alone. r0 is the session's
// approx_distance_mm, else each photo's nominal distance to the table's origin.
// Views with a cost of gate_px or more are rejected. The paper states no uncertainty: the
// covariances are merely finite.
// Errors: bad_input as SolveJoint, and without any distance; cancelled.
// Thread contract: pure; parallel inside; the same bytes for any number of threads.
Result<Poses> SolvePaper(const TriangleMesh& mesh, const PhotoSet& photos,
                         std::span<const Mask> masks, const PaperOptions& options,
                         const ProgressFn& progress = {}, std::stop_token stop = {});

}  // namespace scan
