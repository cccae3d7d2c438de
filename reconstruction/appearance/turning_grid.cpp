#include "reconstruction/appearance/turning_grid.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "drivers/base/units.h"

namespace scan {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Right-handed: `along` is the axis, azimuth 0 is `across`.
struct AxisFrame {
  Vector3d along, across, behind, point;

  Vector3d At(const Vector2d& radius_height, double azimuth) const {
    return point + radius_height.y() * along +
           radius_height.x() * (std::cos(azimuth) * across + std::sin(azimuth) * behind);
  }
};

AxisFrame FrameOf(const Vector3d& axis, const Vector3d& point) {
  AxisFrame frame;
  frame.point = point;
  frame.along = axis.normalized();
  frame.across = frame.along.unitOrthogonal();
  frame.behind = frame.along.cross(frame.across);
  return frame;
}

// Points (radius, height) at most `spacing` apart where the half plane of azimuth 0 cuts the mesh.
std::vector<Vector2d> CutProfile(const TriangleMesh& mesh, const AxisFrame& frame, double spacing) {
  std::vector<Vector2d> points;
  for (const Face& face : mesh.faces) {
    std::array<Vector3d, 3> p;  // across, behind, along
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d d = mesh.vertices[face[k]] - frame.point;
      p[k] = {d.dot(frame.across), d.dot(frame.behind), d.dot(frame.along)};
    }
    std::vector<Vector2d> ends;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d &a = p[k], &b = p[(k + 1) % 3];
      if ((a.y() < 0) == (b.y() < 0)) continue;
      const double t = a.y() / (a.y() - b.y());
      ends.emplace_back(a.x() + t * (b.x() - a.x()), a.z() + t * (b.z() - a.z()));
    }
    if (ends.size() != 2) continue;
    const int steps =
        std::max(1, static_cast<int>(std::ceil((ends[1] - ends[0]).norm() / spacing)));
    for (int i = 0; i <= steps; ++i) {
      const Vector2d q = ends[0] + (ends[1] - ends[0]) * (static_cast<double>(i) / steps);
      if (q.x() > 0) points.push_back(q);
    }
  }
  return points;
}

// The outline from the lowest point near the axis on, a point every `spacing`.
std::vector<Vector2d> WalkProfile(std::vector<Vector2d> points, double spacing) {
  std::vector<Vector2d> walk;
  const auto start =
      std::min_element(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
        return a.x() + a.y() < b.x() + b.y() || (a.x() + a.y() == b.x() + b.y() && a.x() < b.x());
      });
  if (start == points.end()) return walk;
  Vector2d at = *start;
  while (true) {
    walk.push_back(at);
    std::erase_if(points, [&](const Vector2d& p) { return (p - at).norm() < spacing; });
    const auto next =
        std::min_element(points.begin(), points.end(), [&](const Vector2d& a, const Vector2d& b) {
          return (a - at).squaredNorm() < (b - at).squaredNorm();
        });
    if (next == points.end() || (*next - at).norm() > 3 * spacing) return walk;
    at = *next;
  }
}

// Outward: to the right of the way up.
Vector2d ProfileNormal(const std::vector<Vector2d>& walk, std::size_t i) {
  const Vector2d along = walk[std::min(i + 1, walk.size() - 1)] - walk[i > 0 ? i - 1 : 0];
  return Vector2d(along.y(), -along.x()).normalized();
}

}  // namespace

double TurningGrid::step_rad() const { return 2 * kPi / azimuths; }

TurningGrid MakeTurningGrid(const TriangleMesh& mesh, const MeshBvh& bvh, const Vector3d& axis,
                            const Vector3d& point, const TurningGridOptions& options) {
  TurningGrid grid;
  const AxisFrame frame = FrameOf(axis, point);
  grid.axis = frame.along;
  grid.point = point;
  grid.azimuths = options.azimuths;
  double largest = 0, low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Vector3d& v : mesh.vertices) {
    const double height = (v - point).dot(frame.along);
    largest = std::max(largest, (v - point - height * frame.along).norm());
    low = std::min(low, height);
    high = std::max(high, height);
  }
  if (!(largest > 0)) return grid;
  // A profile is some height and two radii long.
  grid.spacing_mm = (high - low + 2 * largest) / options.largest_rings;
  std::vector<Vector2d> walk =
      WalkProfile(CutProfile(mesh, frame, 0.25 * grid.spacing_mm), grid.spacing_mm);
  std::vector<Vector2d> normals;
  for (std::size_t i = 0; i < walk.size(); ++i) normals.push_back(ProfileNormal(walk, i));
  for (std::size_t i = 0; i < walk.size(); ++i) {
    if (walk[i].x() < options.least_radius * largest) continue;
    grid.radius_mm.push_back(walk[i].x());
    for (int k = 0; k < grid.azimuths; ++k) {
      const double azimuth = k * grid.step_rad();
      grid.position.push_back(frame.At(walk[i], azimuth));
      grid.normal.push_back(frame.At(normals[i], azimuth) - point);
    }
  }
  grid.rings = static_cast<int>(grid.radius_mm.size());
  grid.relief_mm.resize(grid.size());
  tbb::parallel_for(std::size_t{0}, grid.size(), [&](std::size_t i) {
    const auto closest = bvh.Closest(grid.position[i]);
    const bool on_surface = closest && closest->distance_mm < options.largest_deviation * largest;
    grid.relief_mm[i] = on_surface ? (closest->point - grid.position[i]).dot(grid.normal[i])
                                   : std::numeric_limits<double>::quiet_NaN();
  });
  return grid;
}

}  // namespace scan
