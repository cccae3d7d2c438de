// Whether the outlines refute the stated size: the mesh's millimetres at the logged distances.
#pragma once

#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "reconstruction/pose/joint_refine.h"

namespace scan {

// Solves again with the mesh's scale free, from `start`. Empty when the scale found is within
// 99.9 % of what the priors of scale, distance and focal length and the outlines allow, or does not
// explain the outlines either; else the reason to reject every view with a logged pose. A wrong
// scale does not show in the deviations of a solve that holds it: its residuals grow, and with them
// the noise that they are weighed by.
// `views`: those whose outlines count. Thread contract: pure; parallel inside.
std::string RefutedScale(const ContourMesh& mesh, RigModel rig,
                         std::span<const PhotoContour> photos, const std::vector<bool>& views,
                         const RigParameters& start, const RefineOptions& options,
                         std::stop_token stop);

}  // namespace scan
