// Bodies of revolution.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace scan {

// The outline of a body of revolution in the half plane (rho >= 0, z), mm: a smooth curve through
// points that begin and end on the axis.
class Profile {
 public:
  Profile(const std::vector<Eigen::Vector2d>& points, int steps_per_span);

  // Exact distance from the body that the outline sweeps around z; negative inside.
  double SignedDistance(const Eigen::Vector3d& p) const;
  double max_radius() const { return max_radius_; }
  double low_z() const { return low_z_; }
  double high_z() const { return high_z_; }

 private:
  // Runs of segments with a bounding circle.
  struct Run {
    std::size_t first, end;
    Eigen::Vector2d centre;
    double radius;
  };
  std::vector<Eigen::Vector2d> line_;
  std::vector<Run> runs_;
  double max_radius_ = 0, low_z_ = 0, high_z_ = 0;
};

}  // namespace scan
