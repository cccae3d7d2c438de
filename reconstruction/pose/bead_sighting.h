// A bead recognised in a photograph.
#pragma once

#include <Eigen/Core>

namespace scan {

struct BeadSighting {
  int bead = 0;                                      // index
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // model frame, mm
  double radius_mm = 0;
  Eigen::Vector2d target = Eigen::Vector2d::Zero();  // middle of the whole ball's image, px
  double sigma_px = 1;                               // of each component
};

}  // namespace scan
