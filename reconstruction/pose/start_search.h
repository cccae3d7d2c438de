// Where a mounting's specimen stands on the table, from nothing: every orientation scored on all
// views at once.
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include "reconstruction/pose/contour_evidence.h"
#include "reconstruction/pose/contour_sample.h"
#include "reconstruction/pose/rig_model.h"

namespace scan {

struct StartOptions {
  int subdivisions = 4;  // of the icosphere of viewing directions: 4 gives 2,562
  int angles = 72;       // in the picture
  int points = 48;       // of each contour
  int candidates = 12;   // kept, at least this far apart:
  double distinct_rad = 0.3;
  double size_slack = 0.06;  // relative error of the silhouette's size that costs nothing
};

struct StartCandidate {
  TableFromModel table_from_model;
  double score =
      0;  // mean two-way contour distance relative to the root of the area, plus penalties
};

// Orientations of the specimen in the table frame whose silhouettes agree best with the photographs
// in use, best first, no two closer than `distinct_rad`.
//
// Templates of the mesh over the viewing directions are compared with each photograph by the
// distance between the contours both ways, silhouette centroid on silhouette centroid; the offset
// from there to the projected mass centre is carried with each template. These tables make the
// score of one orientation in all views a sum of look-ups. The place follows from the rays through
// the projected mass centres and the distances that the areas give. Precondition: every view in use
// has a nominal pose and a contour. Empty when stopped. Parallel inside; the same result for any
// number of threads.
std::vector<StartCandidate> SearchStarts(const ContourMesh& mesh, const RigModel& rig,
                                         std::span<const PhotoContour> photos,
                                         const std::vector<bool>& use, const StartOptions& options,
                                         std::stop_token stop);

// The mesh with the vertices of each cell of a grid merged: for small pictures.
TriangleMesh ClusteredMesh(const TriangleMesh& mesh, double cell_mm);

// The mesh clustered to a sixtieth of its size, for refining many candidates; the mesh itself
// where that saves less than half of the faces.
TriangleMesh MeshForRoughSteps(const ContourMesh& mesh);

// Unit vectors of a subdivided icosahedron: 10 * 4^subdivisions + 2 of them.
std::vector<Eigen::Vector3d> IcosphereDirections(int subdivisions);

}  // namespace scan
