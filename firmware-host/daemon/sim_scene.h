// The specimen that the simulated station photographs.
#pragma once

#include <string>

#include "drivers/base/result.h"
#include "drivers/station/station_config.h"
#include "drivers/station/true_state.h"
#include "reconstruction/mesh/mesh.h"

namespace scan {

struct SimScene {
  SceneRenderer renderer;
  BoundingBox specimen_bounds;  // model frame, mm
};

// Errors: bad_input for an unknown specimen, or in a build without the reconstruction half, which
// has no synthetic specimens.
Result<SimScene> MakeSimScene(const std::string& specimen);

// The specimen stands on the middle of its lowest level.
inline void PlaceOnFoot(PlacementConfig& placement, const BoundingBox& bounds) {
  const Eigen::Vector3d centre = bounds.centre();
  placement.pivot_in_model_mm = {centre.x(), centre.y(), bounds.low.z()};
}

}  // namespace scan
