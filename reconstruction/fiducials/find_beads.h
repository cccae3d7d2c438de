// Beads in a CT volume.
#pragma once

#include <optional>
#include <vector>

#include "drivers/base/result.h"
#include "reconstruction/fiducials/bead.h"
#include "reconstruction/volume/volume.h"

namespace scan {

struct FindBeadsOptions {
  double diameter_mm = 1.0;
  std::optional<double> threshold{};  // grey value that only beads exceed; else several are tried
  double diameter_tolerance = 0.2;    // relative
  double roundness = 0.1;             // largest RMS residual relative to the radius
};

// The balls of the given diameter that are denser than what they sit in.
//
// Connected voxels above each of some high thresholds (OtsuLevels) that are about a ball's volume
// are candidates. A sphere is fitted to the places along rays from the centre at which the grey
// passes half way from the ball's own to that outside of it there, so that air on one side and
// tissue on the other do not shift it. Round things inside a specimen (seeds) are told from
// beads by their density: balls with less than 3/4 of the densest one's contrast are left out. In
// the order of their first voxel. Errors: bad_input for a diameter below four voxels, an empty
// volume, or no such ball: then the error says what comes nearest. Thread contract: pure.
Result<std::vector<Bead>> FindBeads(const Volume& volume, const FindBeadsOptions& options);

// Least-squares sphere through points, robust against a few that are not on it; needs four.
// `residual_mm` is that of the points kept; `sigma_mm` takes the points as independent.
std::optional<Bead> FitSphere(const std::vector<Eigen::Vector3d>& points);

}  // namespace scan
