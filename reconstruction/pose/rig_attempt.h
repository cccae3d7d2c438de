// One run of the joint solve: start, refine, find what changed on the rig, refine again.
#pragma once

#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "drivers/base/result.h"
#include "reconstruction/pose/joint_refine.h"
#include "reconstruction/pose/rig_changes.h"
#include "reconstruction/pose/start_search.h"

namespace scan {

struct RigAttempt {
  RigModel rig;  // with what the changes needed
  RefineResult fit;
  std::vector<RigChange> changes;
  std::vector<bool> use;   // without the views that stand alone
  bool reversed = false;   // the turntable runs against its log
  double distance_px = 0;  // mean two-way distance of the outlines of all views
};

struct AttemptInput {
  const ContourMesh& mesh;
  std::span<const PhotoContour> photos;
  std::span<const std::string> names;  // of the photographs
  const std::vector<bool>& use;
  const std::vector<bool>& known;  // mountings that need no search
  const StartOptions& search;
  const RefineOptions& refine;
  const ChangeOptions& changes;
};

// Solves with the turntable's sign as logged; where that leaves the outlines unexplained or needs
// three changes and more, also with the other sign, and keeps what explains them far better.
// Errors: cancelled. Parallel inside; the same bytes for any number of threads.
Result<RigAttempt> SolveWithChanges(const AttemptInput& input, const RigModel& rig,
                                    std::stop_token stop);

}  // namespace scan
