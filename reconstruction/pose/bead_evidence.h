// What a bead's image says about its camera, in the terms of the contours' evidence.
#pragma once

#include <Eigen/Core>
#include <span>

#include "reconstruction/pose/bead_sighting.h"
#include "reconstruction/pose/contour_evidence.h"

namespace scan {

using BeadDerivative = Eigen::Matrix<double, 2, kEvidenceSize>;

// Middle of the ellipse that a whole ball's image is, px. It lies off the image of the ball's
// centre (X, Y, Z) by the image of (X, Y, Z - R^2 / Z): 0.0002 px for a ball of 1 mm in a
// photograph 1848 px wide from 550 mm, but 0.2 px for one of 4 mm from 100 mm. Precondition: the
// ball is in front of the camera, Z > R.
Eigen::Vector2d BeadPixel(const ViewState& state, const Eigen::Vector3d& centre, double radius_mm);

// target - BeadPixel, px. `dr`, when given, receives the derivative by what ContourResidual's is
// by; `pivot` is in the camera frame. The mask bias moves no bead.
Eigen::Vector2d BeadResidual(const ViewState& state, const BeadSighting& sighting,
                             const Eigen::Vector3d& pivot, BeadDerivative* dr);

// Adds the sightings to an evidence that was condensed at evidence.state; beyond three sigma their
// weight falls with the distance (Huber).
void AddBeads(std::span<const BeadSighting> sightings, CondensedEvidence& evidence);

}  // namespace scan
