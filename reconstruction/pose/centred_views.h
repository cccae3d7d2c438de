// Cameras turned to where their silhouettes are, where the log knows them less well than the
// contours' search along their normals reaches.
#pragma once

#include <span>
#include <vector>

#include "reconstruction/pose/contour_evidence.h"
#include "reconstruction/pose/contour_sample.h"
#include "reconstruction/pose/rig_model.h"

namespace scan {

// The nominal rig, but for views whose own stated sigma moves the image of the specimen by more
// than `reach_px`: these are turned and shifted, each by its share of that variance, until the
// silhouette of the mesh has its centroid on that of the photograph. Left as logged are views that
// would have to move by more than five sigma, and contours cut by the border. Every view in use has
// a contour. Parallel inside; the same bytes for any number of threads.
RigParameters CentredViews(const ContourMesh& mesh, const RigModel& rig,
                           std::span<const PhotoContour> photos, const std::vector<bool>& use,
                           double reach_px);

}  // namespace scan
