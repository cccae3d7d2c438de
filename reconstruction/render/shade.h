// Pictures of a mesh for people: reports, documentation, a look at a stage's result.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "reconstruction/mesh/mesh.h"

namespace scan {

struct ShadeOptions {
  int height_px = 480;  // [16, 4096]; the width follows the specimen
  int sides = 2;        // >= 1: panels beside each other, turned about the longest axis
};

// The mesh lit from the upper left with the light of the sky around it, the specimen's longest axis
// upright, the first panel seen along its thinnest axis. CV_8UC3 (BGR, sRGB), white background.
// `colour`: one per face in [0, 1], linear, RGB; empty for neutral grey.
// Precondition: a mesh with at least one face; `colour` empty or one per face.
// Thread contract: pure; parallel inside, same bytes for any number of threads.
cv::Mat ShadedPicture(const TriangleMesh& mesh, const std::vector<Eigen::Vector3f>& colour,
                      const ShadeOptions& options = {});

// Share of the open sky that each vertex sees, weighted by the cosine to its normal, [0, 1]: 1 on a
// convex body. Both sides of a face hide. Thread contract: as above.
std::vector<float> SkyShare(const TriangleMesh& mesh);

}  // namespace scan
