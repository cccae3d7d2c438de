// The cross product in the plane.
#pragma once

#include <Eigen/Core>

namespace scan {

// Twice the signed area of the triangle 0, a, b; positive when b lies anticlockwise of a.
inline double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace scan
