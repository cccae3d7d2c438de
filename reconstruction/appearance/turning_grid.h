// The surface of a body of revolution as rings and azimuths: a turn about its axis shifts columns.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "reconstruction/mesh/bvh.h"
#include "reconstruction/mesh/mesh.h"

namespace scan {

struct TurningGridOptions {
  int azimuths = 720;         // nodes round the axis; a multiple of four
  int largest_rings = 128;    // along the profile
  double least_radius = 0.1;  // share of the largest: rings nearer to the axis tell no azimuth
  // A node stands on the surface where the mesh lies within this share of the largest radius.
  double largest_deviation = 0.04;
};

// Node (ring, azimuth) is at index ring * azimuths + azimuth; rings follow the profile from the
// lowest point of the axis. Lengths in mm, model frame.
struct TurningGrid {
  Eigen::Vector3d axis, point;  // unit length; a point on the axis
  int rings = 0, azimuths = 0;
  double spacing_mm = 0;                  // between rings
  std::vector<double> radius_mm;          // per ring
  std::vector<Eigen::Vector3d> position;  // per node, on the mean profile
  std::vector<Eigen::Vector3d> normal;    // outward, of the profile turned about the axis
  // Height of the mesh over the node along the normal; NaN where the surface strays too far.
  std::vector<double> relief_mm;

  int index(int ring, int azimuth) const { return ring * azimuths + azimuth; }
  std::size_t size() const { return position.size(); }
  double step_rad() const;
};

// Azimuth 0 lies in an arbitrary but fixed direction; the profile is cut from the mesh there. Empty
// (no rings) where the mesh has no surface round the axis. Precondition: `axis` is not zero.
// Thread contract: pure; parallel inside; the same bytes for any number of threads.
TurningGrid MakeTurningGrid(const TriangleMesh& mesh, const MeshBvh& bvh,
                            const Eigen::Vector3d& axis, const Eigen::Vector3d& point,
                            const TurningGridOptions& options = {});

}  // namespace scan
