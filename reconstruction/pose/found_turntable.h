// The rig behind photographs without logged poses: one camera before a specimen that was turned.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "acquisition/session/photo_set.h"
#include "drivers/base/frames.h"
#include "reconstruction/pose/poses.h"

namespace scan {

struct FoundTurntable {
  PhotoSet photos;  // its poses logged for the views that stand on it, with wide sigmas
  TableFromModel table_from_model;
  int views = 0;  // that stand on it
};

// Looks for one axis that all accepted views turn about: `poses` of photographs that were each
// found alone, `centre` of the mesh in the model frame. Views without a free direction decide: they
// stand on it when what is left of each is within what its own covariance allows, for three
// quarters of them. A view with a free direction belongs to it when it is off by less than 5
// degrees. None for fewer than six that decide, for turns that do not span 30 degrees and for views
// of several aims or mountings.
std::optional<FoundTurntable> FindTurntable(const PhotoSet& photos, const Poses& poses,
                                            const Eigen::Vector3d& centre);

// The common axis of rotations: unit vector a with R_i R_j' a = a, in the frame they lead to, the
// rotations' weights growing with their angles. Precondition: two rotations that differ.
Eigen::Vector3d CommonAxis(std::span<const CameraFromModel> poses);

}  // namespace scan
