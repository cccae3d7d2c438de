// Coarse exhaustive search over directions, distances and angles in the picture.
#pragma once

#include <cstdint>
#include <vector>

#include "reconstruction/mesh/mesh.h"
#include "reconstruction/pose/paper/paper_camera.h"
#include "reconstruction/pose/picture_cost.h"

namespace scan {

// One rendered silhouette: its boundary about its own mass centre, in px of the reduced picture.
struct PaperTemplate {
  PaperCamera camera;
  std::vector<Eigen::Vector2f> boundary;  // about `centroid`
  Eigen::Vector2d centroid;               // g_r, about the picture's principal point
};

// Every direction at every distance; templates without a silhouette in the picture are left out.
// Parallel inside, same result for any number of threads.
std::vector<PaperTemplate> RenderTemplates(const TriangleMesh& mesh,
                                           const Eigen::Vector3d& mass_centre,
                                           const std::vector<Eigen::Vector3d>& directions,
                                           const std::vector<double>& distances_mm,
                                           const Intrinsics& reduced);

struct PaperStart {
  PaperCamera camera;
  double cost_px = 0;  // Eq 4
};
// The template and angle of least Eq 4, as a camera by Eq 5. Points that are turned out of the
// picture count neither in the sum nor in its divisor (the paper keeps them in the divisor, which
// favours clipped views). Parallel over the templates, same result for any number of threads.
PaperStart SearchTemplates(const std::vector<PaperTemplate>& templates,
                           const ReducedPicture& picture, int angle_step_deg);

}  // namespace scan
