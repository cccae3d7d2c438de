// The six camera parameters of Ijiri et al. 2018.
#pragma once

#include <array>

#include "drivers/base/frames.h"

namespace scan {

// Angles in rad, r in mm, about the mesh's mass centre.
struct PaperCamera {
  double theta = 0, phi = 0, r = 0;
  double delta_x = 0, delta_y = 0, delta_z = 0;

  std::array<double, 6> array() const { return {theta, phi, r, delta_x, delta_y, delta_z}; }
  static PaperCamera From(const std::array<double, 6>& c) {
    return {c[0], c[1], c[2], c[3], c[4], c[5]};
  }
};

// Ijiri 2018, Eq 1. `mass_centre` in the model frame.
CameraFromModel CameraFromModelOf(const PaperCamera& camera, const Eigen::Vector3d& mass_centre);

// The camera on the ray from the mass centre along `direction` (unit length), not turned.
PaperCamera LookFrom(const Eigen::Vector3d& direction, double r_mm);

}  // namespace scan
