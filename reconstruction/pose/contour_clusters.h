// The edges of a mesh in clusters of alike direction, most of which cannot be part of an outline.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/render/contour_generators.h"

namespace scan {

struct ContourCluster {
  std::uint32_t first_edge = 0, edge_count = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // of a ball around the faces; model frame
  double radius_mm = 0;
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  // of a cone around the faces' normals
  double cone_sin = 1, cone_cos = 0;               // of its half angle; 90 degrees: of no use
};

struct ContourEdge {
  std::array<std::uint32_t, 2> ends;
  std::uint32_t first_corner = 0, corner_count = 0;  // the third one of each of its faces
};

// Everything in the order in which the clusters use it: a call looks at a tenth of a fine mesh, and
// its time is that of fetching the rest of the cache lines.
struct ContourClusters {
  std::vector<ContourCluster> clusters;
  std::vector<ContourEdge> edges;
  std::vector<std::uint32_t> corners;
  std::vector<Eigen::Vector3d> points;       // what ends and corners count in; model frame, mm
  std::vector<std::uint32_t> mesh_vertices;  // of each point
};

// Every edge of the mesh once. Edges that are sharp, or not between two faces that run through them
// in opposite directions, are in clusters with a useless cone. Depends on nothing but its
// arguments.
ContourClusters MakeContourClusters(const TriangleMesh& mesh, const MeshEdges& edges);

// True where every face of the cluster turns the same side to the camera, with something to spare,
// so that no edge of it is a fold of the outline. False means nothing. `camera_centre`: of the same
// camera, model frame.
bool TurnsOneSide(const ContourCluster& cluster, const CameraFromModel& camera_from_model,
                  const Intrinsics& intrinsics, const Eigen::Vector3d& camera_centre);

}  // namespace scan
