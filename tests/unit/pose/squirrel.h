// The real squirrel: photographs on a turntable with nominal poses, and a scan made by others.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "reconstruction/masks/mask.h"
#include "reconstruction/mesh/mesh.h"

namespace scan::test {

struct Squirrel {
  PhotoSet photos;
  std::vector<Mask> masks;
  TriangleMesh mesh;
  std::map<std::string, CameraFromModel> truth;  // calibrated, by name; similarity removed
  Intrinsics true_intrinsics;
};

// Nothing where the data folder is absent.
std::optional<Squirrel> LoadSquirrel(const std::filesystem::path& folder);

}  // namespace scan::test
