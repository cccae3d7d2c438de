// Solids as smooth unions of primitives with exact distances.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "reconstruction/mesh/mesh.h"

namespace scan {

// All lengths in mm, model frame. Every distance is exact, negative inside.
struct Ellipsoid {
  Eigen::Vector3d centre;
  Eigen::Vector3d radii;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // columns: directions of the radii
};
double SignedDistance(const Ellipsoid& ellipsoid, const Eigen::Vector3d& p);

// The convex hull of two balls.
struct RoundCone {
  Eigen::Vector3d a, b;
  double radius_a = 0, radius_b = 0;
};
double SignedDistance(const RoundCone& cone, const Eigen::Vector3d& p);

// Smooth minimum with support k: equals min(a, b) where they differ by k or more. Of two functions
// of slope at most 1 it is one again (Quilez, polynomial form).
inline double SmoothMin(double a, double b, double k) {
  if (!(k > 0)) return std::min(a, b);
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - 0.25 * h * h * k;
}

struct Part {
  std::variant<Ellipsoid, RoundCone> primitive;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // bounding ball
  double radius = 0;
};

// Parts blended among themselves with `blend_mm`; `material` tells the colour.
struct PartGroup {
  int material = 0;
  double blend_mm = 0;       // among its parts
  double join_blend_mm = 0;  // with the groups before
  std::vector<Part> parts;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // bounding ball
  double radius = 0;
};

class Shape {
 public:
  PartGroup& AddGroup(int material, double blend_mm, double join_blend_mm);
  // Computes the bounding balls; called once after the last part was added.
  void Finish();

  // Slope at most 1: a lower bound of the distance to the surface, exact outside of blends.
  double SignedDistance(const Eigen::Vector3d& p) const;
  // The material of the group nearest to p.
  int MaterialAt(const Eigen::Vector3d& p) const;
  BoundingBox Bounds() const;

 private:
  std::vector<PartGroup> groups_;
};

void Add(PartGroup& group, const Ellipsoid& ellipsoid);
void Add(PartGroup& group, const RoundCone& cone);
// A chain of round cones along a Catmull-Rom curve through the points; radii follow linearly.
void AddSwept(PartGroup& group, const std::vector<Eigen::Vector3d>& points,
              const std::vector<double>& radii, int steps_per_span);

}  // namespace scan
