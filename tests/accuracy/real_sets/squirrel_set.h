// The real squirrel: photographs on a turntable with nominal poses, and a scan made by others.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "reconstruction/evaluate/calibrated.h"
#include "reconstruction/masks/mask.h"
#include "reconstruction/mesh/mesh.h"

namespace scan::test {

struct Squirrel {
  PhotoSet photos;  // principal point 3.3 px off, axis tilted by 1.72 degrees
  std::vector<Mask> masks;
  TriangleMesh mesh;
  CalibratedCameras truth;  // similarity removed
};

// Nothing where the data folder is absent.
std::optional<Squirrel> LoadSquirrel(const std::filesystem::path& folder);

// No evidence of the lowest 12 % of each silhouette: the base is dark there.
void IgnoreBase(std::vector<Mask>& masks);

}  // namespace scan::test
