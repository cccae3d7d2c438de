// Points of the mesh whose image bounds the specimen's silhouette.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/pose/contour_clusters.h"
#include "reconstruction/render/contour_generators.h"

namespace scan {

// What the contour search needs of a mesh, computed once. Open, self-intersecting and
// inconsistently oriented meshes are all right.
struct ContourMesh {
  explicit ContourMesh(const TriangleMesh& triangle_mesh);

  const TriangleMesh& mesh;  // outlives this
  MeshEdges edges;
  ContourClusters clusters;
  // Faces run through every edge as often one way as the other: every line of sight enters as
  // often as it leaves. Stays so when vertices are merged.
  bool closed = false;
  std::vector<Eigen::Vector3d> vertex_normals;  // smooth; zero where undefined
  Eigen::Vector3d centre;                       // mass centre, model frame
  double radius_mm = 0;                         // largest distance of a vertex from it
};

struct ContourSample {
  Eigen::Vector3d point;   // model frame, mm
  Eigen::Vector2d pixel;   // its image
  Eigen::Vector2d normal;  // of the contour in the picture, unit length, towards the background
  Eigen::Vector2d half;    // half of the projected piece, which is pixel +- half
  double length_px = 0;    // of contour that the sample stands for
  std::array<std::uint32_t, 2> vertices{};  // of the mesh edge it lies on
};

// The visible contour generators that border on the background (outer ones and those around holes
// of the silhouette): one sample per projected edge, long edges divided into pieces of about
// `spacing_px`; of edges shorter than half of that only as many are kept as make up that length.
// Generators outside of the picture are left out. Thread contract: pure.
std::vector<ContourSample> FindContourSamples(const ContourMesh& mesh,
                                              const CameraFromModel& camera_from_model,
                                              const Intrinsics& intrinsics, double spacing_px);

}  // namespace scan
