// One chart as a mesh of its own: what is unfolded and packed.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "reconstruction/atlas/surface_graph.h"
#include "reconstruction/mesh/mesh.h"

namespace scan {

struct ChartMesh {
  std::vector<std::uint32_t> faces;          // of the surface, ascending
  TriangleMesh mesh;                         // consistently oriented, its faces as in `faces`
  std::vector<std::uint32_t> source_vertex;  // per vertex of `mesh`
  std::vector<std::array<std::uint32_t, 2>> border;  // directed as in their faces
  bool disk = false;                                 // one border, no handle
  std::vector<Eigen::Vector2d> uv;                   // per vertex of `mesh`; empty until unfolded
};

// Vertices where the chart only touches itself are split, so that it is always a manifold.
// Precondition: `faces` ascending, not degenerate, connected through links.
ChartMesh MakeChartMesh(const TriangleMesh& mesh, const SurfaceGraph& graph,
                        std::vector<std::uint32_t> faces);

// Whether these faces, glued along all links between them, form a topological disk.
bool IsDisk(const TriangleMesh& mesh, const SurfaceGraph& graph,
            const std::vector<std::uint32_t>& ascending_faces);

// Halves a chart of two or more faces between two far apart seeds; both parts are connected.
std::array<std::vector<std::uint32_t>, 2> Bisect(const SurfaceGraph& graph,
                                                 const std::vector<std::uint32_t>& ascending_faces);

}  // namespace scan
