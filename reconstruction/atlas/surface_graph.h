// The faces of a mesh as a graph across their edges, consistently oriented.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "reconstruction/mesh/mesh.h"

namespace scan {

// Across an edge: the other face and which of its edges it is; face -1 where the surface ends, is
// not manifold or cannot be oriented.
struct FaceLink {
  std::int32_t face = -1;
  std::int8_t edge = 0;
};

// Per face. Degenerate faces (no area) have no links.
struct SurfaceGraph {
  std::vector<std::array<FaceLink, 3>> links;
  std::vector<char> flipped;  // turned round so that linked faces agree
  std::vector<char> degenerate;
  std::vector<double> area;             // mm^2
  std::vector<Eigen::Vector3d> normal;  // of the turned face, smoothed over neighbours
  std::vector<Eigen::Vector3d> centre;  // mm
};

SurfaceGraph MakeSurfaceGraph(const TriangleMesh& mesh);

}  // namespace scan
