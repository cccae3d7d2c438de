// Real photographs of other people, with cameras that they or a marker board calibrated.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "drivers/base/frames.h"
#include "reconstruction/masks/mask.h"

namespace scan::test {

struct RealSet {
  PhotoSet photos;  // one lens, with path; the truth is not in it
  std::vector<Mask> masks;
  std::vector<CameraFromModel> truth;             // of each photo
  Intrinsics intrinsics;                          // calibrated
  std::vector<bool> whole;                        // of each photo: the silhouette is
  Eigen::AlignedBox3d box_mm;                     // of the model frame, around the specimen
  double voxel_mm = 0;                            // of the hull: two to three pixels
  std::map<std::string, TableFromModel> placing;  // where a turntable was logged
};

// A ceramic dinosaur on a gantry (Seitz et al. 2006), 640 x 480: of the photographs that are listed
// for good silhouettes those whose silhouette does not leave the picture. No logged poses.
// Nothing where the folder is absent.
std::optional<RealSet> LoadDino(const std::filesystem::path& folder);

// Error of a nominal camera, of each of its three rotations and shifts.
struct NominalError {
  double deg = 0, mm = 0;
};

// An apple on a board of markers that was turned by hand, 1000 x 750. Model and table frame are the
// board's, z up, at the middle of the circle that the camera describes. The camera stood still:
// that of the first photograph, with `error`, turned by the board's angle in whole degrees is
// nominal for all. Sigmas: the error, 0.5 degrees and 3 mm; of each view 0.3 degrees and 3 mm, as
// the board slipped. Nothing where the folder is absent.
std::optional<RealSet> LoadApple(const std::filesystem::path& folder, const NominalError& error);

}  // namespace scan::test
