// Whether every planned view keeps the whole specimen in the picture.
#pragma once

#include <string>
#include <vector>

#include "acquisition/session/session_document.h"
#include "drivers/base/frames.h"
#include "drivers/base/result.h"

namespace scan {

// Where a camera is expected when the axes stand at these positions:
// camera_from_lift * lift_from_station * station_from_table.
// Errors: bad_input for a camera or aim that the station does not have, an aim without nominal
// pose. Thread contract: pure.
Result<CameraFromTable> NominalPose(const StationDocument& station, const std::string& camera,
                                    const std::string& aim_id, double turntable_deg,
                                    double lift_mm);

// Contains the specimen at every turntable angle: about the table's axis, z above the platter.
struct BoundingCylinder {
  double radius_mm = 0;
  double z_low_mm = 0;
  double z_high_mm = 0;
};

// Refuses a plan of which a view does not show the whole cylinder at least `margin_px` inside the
// picture. The error names the worst view, its aim, the border and the excess in pixels and in mm
// at the specimen. Errors: bad_input. Thread contract: pure.
Status CheckFraming(const std::vector<PlannedView>& views, const StationDocument& station,
                    const BoundingCylinder& cylinder, double margin_px);

}  // namespace scan
