// From many starts to one: candidates are refined on all views at once and the best is kept.
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include "drivers/base/result.h"
#include "reconstruction/pose/joint_refine.h"
#include "reconstruction/pose/start_search.h"

namespace scan {

struct ChosenStart {
  TableFromModel table_from_model;
  double distance_px = 0;  // mean two-way contour distance of its refined poses
};

// Sets each mounting's start for which `known` is false: searches, refines every candidate with a
// coarse mesh on at most 8 views, the best three with the full one, and keeps the one whose
// contours lie nearest. Candidates of a mounting are compared with its own views only. A mounting
// without a view in use keeps its start. Errors: cancelled. Parallel inside; the same result for
// any number of threads.
Result<std::vector<ChosenStart>> ChooseStarts(const ContourMesh& mesh, RigModel& rig,
                                              std::span<const PhotoContour> photos,
                                              const std::vector<bool>& use,
                                              const std::vector<bool>& known,
                                              const StartOptions& search,
                                              const RefineOptions& refine, std::stop_token stop);

}  // namespace scan
