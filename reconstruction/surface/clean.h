// A closed manifold out of what contouring and decimation leave.
#pragma once

#include <cstddef>

#include "reconstruction/mesh/mesh.h"

namespace scan {

struct CleanReport {
  std::size_t degenerate_faces = 0;  // removed: two corners the same
  std::size_t cancelled_faces = 0;   // removed: pairs back to back with the same corners
  std::size_t split_edges = 0;       // had more than two faces
  std::size_t split_vertices = 0;    // had more than one fan of faces
  std::size_t small_components = 0;  // removed
};

// Removes degenerate faces and back-to-back pairs, splits edges with more than two faces and
// vertices with more than one fan, drops unreferenced vertices. Face order is kept. A surface whose
// edges balance (each directed edge has as many opposite ones, as after any edge collapse of a
// closed surface) becomes a closed manifold; boundaries stay boundaries.
// Thread contract: pure. Source: Gueziec, Taubin, Lazarus, Horn 2001 (cutting and stitching).
CleanReport MakeManifold(TriangleMesh& mesh);

// Removes connected components of less than `least_share` of the faces of the largest and, on
// request, those that face inward (walls of cavities). Returns the number removed.
// Precondition: manifold.
std::size_t DropSmallComponents(TriangleMesh& mesh, double least_share, bool drop_cavities);

// Low-pass smoothing that keeps the volume (positive and negative steps alternate); no vertex moves
// farther than `limit_mm` from where it was.
// Thread contract: pure. Source: Taubin 1995.
void Smooth(TriangleMesh& mesh, int iterations, double limit_mm);

}  // namespace scan
