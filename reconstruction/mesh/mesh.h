// An indexed triangle mesh in the model frame.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace scan {

using Face = std::array<std::uint32_t, 3>;

// Lengths in mm, model frame. Faces are counter-clockwise seen from outside where the mesh is
// consistently oriented; nothing here needs them to be. Every index is below vertices.size().
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Face> faces;
};

// Area-weighted, of unit length; zero where a vertex has no face with an area.
std::vector<Eigen::Vector3d> VertexNormals(const TriangleMesh& mesh);

// Of unit length; zero for a degenerate face.
std::vector<Eigen::Vector3d> FaceNormals(const TriangleMesh& mesh);

double SurfaceArea(const TriangleMesh& mesh);

// Signed volume by the divergence theorem; positive for outward faces of a closed mesh.
double SignedVolume(const TriangleMesh& mesh);

// Mass centre of the enclosed solid where the mesh is nearly closed, else of the surface.
Eigen::Vector3d MassCentre(const TriangleMesh& mesh);

struct BoundingBox {
  Eigen::Vector3d low, high;
  double diagonal() const { return (high - low).norm(); }
  Eigen::Vector3d centre() const { return 0.5 * (low + high); }
};
// Precondition: at least one vertex.
BoundingBox BoundsOf(const TriangleMesh& mesh);

struct TopologyReport {
  std::size_t boundary_edges = 0;       // edges with one face
  std::size_t non_manifold_edges = 0;   // edges with three or more
  std::size_t non_manifold_vertices = 0;  // vertices whose faces form more than one fan
  std::size_t inconsistent_edges = 0;   // two faces that run the same way along an edge
  std::size_t components = 0;
  std::ptrdiff_t euler = 0;  // V - E + F of referenced vertices
  bool closed_manifold() const {
    return boundary_edges == 0 && non_manifold_edges == 0 && non_manifold_vertices == 0 &&
           inconsistent_edges == 0;
  }
};
TopologyReport CheckTopology(const TriangleMesh& mesh);

// For each face the faces across its three edges (edge k joins corner k and k+1), -1 at a boundary
// and at non-manifold edges.
std::vector<std::array<std::int32_t, 3>> FaceNeighbours(const TriangleMesh& mesh);

}  // namespace scan
