// A mesh's surface in coarse cells: ways along it, and its tips.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "reconstruction/pose/contour_sample.h"

namespace scan {

// Vertices in one cube of a grid are one cell; edges of the mesh join cells.
struct SurfaceCells {
  std::vector<int> of_vertex;
  std::vector<Eigen::Vector3d> centre;  // mean of its vertices, model frame
  std::vector<std::vector<int>> beside;
  double size_mm = 0;
};

// `size_mm`: of a cube's edge; a mesh of some hundred cubes' width at most.
SurfaceCells CellsOf(const ContourMesh& mesh, double size_mm);

// Shortest ways in mm along the surface from any of `sources`; infinite where there is none.
std::vector<double> DistancesFrom(const SurfaceCells& cells, const std::vector<int>& sources);

// The cells farther out than all beside them, by the way along the surface from the cell of their
// connected piece that is nearest to `centre`; of those within `reach_mm` of each other the
// farthest.
std::vector<int> TipsOf(const SurfaceCells& cells, const Eigen::Vector3d& centre, double reach_mm);

}  // namespace scan
