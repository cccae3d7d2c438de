// Sentences about what went wrong with a rig: what, where and how much.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "reconstruction/pose/joint_result.h"
#include "reconstruction/pose/rig_changes.h"

namespace scan {

// A sentence for each lasting change, with the sizes that the last solve gives them, and one for
// each reference epoch whose zero differs from the first one's by more than three sigma.
// `specimen`: mass centre, model frame.
std::vector<std::string> RigNotes(const PhotoSet& photos, const RigModel& rig,
                                  const RigParameters& parameters, const RigPosterior& posterior,
                                  std::span<const RigChange> changes,
                                  const Eigen::Vector3d& specimen);

// Why a view that stands alone is rejected. `seen`: the pose that its own outline gives;
// `expected`: that of the rig.
std::string ReasonOfViewAlone(const CameraFromModel& seen, const CameraFromModel& expected,
                              const Eigen::Vector3d& specimen);

}  // namespace scan
