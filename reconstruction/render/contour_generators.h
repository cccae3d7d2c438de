// The edges of a mesh that make its outline in a picture.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/render/rasterise.h"

namespace scan {

struct MeshEdge {
  std::array<std::uint32_t, 2> vertices;         // the lower index first
  std::uint32_t first_face = 0, face_count = 0;  // in MeshEdges::faces
};

// Every edge of a mesh once, sorted by its vertices; depends on the faces alone except `outward`.
struct MeshEdges {
  std::vector<MeshEdge> edges;
  std::vector<std::uint32_t> faces;
  int outward = 0;  // 1: closed, consistent, faces look outward; -1: inward; 0: neither is known
};
MeshEdges BuildMeshEdges(const TriangleMesh& mesh);

// Whether one of the face's sides goes from the edge's first vertex to its second.
bool RunsForward(const Face& face, const std::array<std::uint32_t, 2>& edge);
// The face's corner that is not on the edge; the edge's first vertex for a degenerate face.
std::uint32_t OppositeVertex(const Face& face, const std::array<std::uint32_t, 2>& edge);

struct ContourSegment {
  std::array<std::uint32_t, 2> vertices;  // of the mesh
  std::array<std::int32_t, 2> faces;      // of the mesh; -1 for the missing one of a boundary edge
  // Both judged at the middle of the segment; false when that is outside of the picture.
  bool visible = false;  // no nearer surface covers it
  bool outer = false;    // lies on the border between the projected mask and the background
};

// The contour generator: edges all of whose faces project to the same side of the edge (for a
// consistent mesh: one face seen from the front, one from the back), and boundary edges. Face
// orientation is not used for this. `raster` is the mesh rendered with the same camera;
// `depth_tolerance_mm` is how much nearer a surface must be to hide a segment. Edges with a vertex
// at z <= 0 are left out. Order as in `edges`; same result for any number of threads.
// Thread contract: pure; parallel inside.
std::vector<ContourSegment> ContourGenerators(const TriangleMesh& mesh, const MeshEdges& edges,
                                              const CameraFromModel& camera_from_model,
                                              const Intrinsics& intrinsics, const Raster& raster,
                                              double depth_tolerance_mm = 0.05);

}  // namespace scan
