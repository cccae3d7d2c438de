// A mesh with one texture coordinate per vertex, split along the seams of its atlas.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "reconstruction/mesh/mesh.h"

namespace scan {

// uv in [0, 1], (0, 0) at the top left corner of the picture, v down, as in glTF: texel (i, j) of a
// square atlas of n texels has its centre at ((i + 0.5) / n, (j + 0.5) / n). OBJ files flip v.
struct AtlasMesh {
  TriangleMesh mesh;                         // vertices on a seam appear once per chart
  std::vector<Eigen::Vector2d> uv;           // per vertex of `mesh`
  std::vector<std::uint32_t> source_vertex;  // vertex of the unsplit surface; equal ids are one point
  std::vector<std::uint32_t> chart;          // per face
};

}  // namespace scan
