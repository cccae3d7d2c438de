// Views on rings around the specimen.
#pragma once

#include <string>
#include <vector>

#include "acquisition/session/session_document.h"
#include "drivers/base/result.h"

namespace scan {

// Equal steps of one full turn at one lift height, the camera at one aim.
struct Ring {
  std::string aim_id = "a0";
  double lift_mm = 0;
  int count = 12;                             // positions, 1 to 3600
  double start_deg = 0;                       // turntable angle of the first view
  double exposure_us = 0;                     // 0: as the camera stands
  std::vector<std::string> cameras = {"c0"};  // each takes a view at every position
  std::string mounting_id = "m0";
};

// The views of all rings, v000 and on, ring after ring in the order given. Within a ring the angle
// only grows, from start_deg to below start_deg + 360, so that backlash is taken up on one side.
// Errors: bad_input for no ring, a count, number or id out of range, more than 100000 views.
// Thread contract: pure.
Result<std::vector<PlannedView>> PlanRings(const std::vector<Ring>& rings);

// Ids are [a-z0-9-]+ and differ, numbers are finite, slices >= 1, exposure >= 0, at least one view.
// Errors: bad_input. Thread contract: pure.
Status CheckViews(const std::vector<PlannedView>& views);

}  // namespace scan
