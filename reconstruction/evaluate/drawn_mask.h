// Masks of a mesh at a known camera, with stated errors of their outlines.
#pragma once

#include <cstdint>
#include <vector>

#include "reconstruction/evaluate/contour_noise.h"
#include "reconstruction/masks/mask.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/pose/score.h"

namespace scan {

// The true outlines in pixels of `intrinsics`, to a few hundredths of one: the contours of a finer
// picture. Precondition: all of the mesh in front of the camera. Thread contract: pure.
std::vector<Contour> TrueOutlines(const TriangleMesh& mesh,
                                  const CameraFromModel& camera_from_model,
                                  const Intrinsics& intrinsics);

struct DrawnMaskOptions {
  ContourNoise noise;
  int samples = 8;  // squared: points of coverage in each pixel, of outlines that do not stray
  std::uint64_t seed = 12;
};

// Area coverage of `mesh` (model frame, mm) at `camera`. `view` tells the noise of one photograph
// from that of the others. Precondition: as TrueOutlines. Thread contract: pure.
Mask DrawMask(const TriangleMesh& mesh, const PoseOf& camera, const DrawnMaskOptions& options,
              std::size_t view);

}  // namespace scan
