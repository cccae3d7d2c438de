// The photographs to import, as each source tells them.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/session/session_document.h"
#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "drivers/base/result.h"

namespace scan {

struct ImportedPhoto {
  std::filesystem::path path, mask, ignore;  // the latter two empty where there is none
  Intrinsics intrinsics;                     // w and h are those of the file
  IntrinsicsSigma sigma;
  std::optional<CameraFromTable> camera_from_table;
  std::optional<double> turntable_deg, lift_mm;
  double turntable_sigma_deg = 0, lift_sigma_mm = 0;  // of this view alone
  std::optional<PriorSigma> prior_sigma;              // common to the aim
  PriorSigma prior_sigma_view;
  std::string aim_id = "a0";
  std::string mounting_id = "m0";
  int reference_epoch = 1;
};

struct ImportedSet {
  std::vector<ImportedPhoto> photos;
  std::optional<double> approx_distance_mm;
};

// transforms.json; file paths are looked for beside it, then by their name in `photos` (may be
// empty).
Result<ImportedSet> PhotosFromTransforms(const std::filesystem::path& file,
                                         const std::filesystem::path& photos);

// cameras.txt and images.txt with the models SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV
// and FULL_OPENCV (up to k3); COLMAP's world is taken as the table frame, its unit as mm.
Result<ImportedSet> PhotosFromColmap(const std::filesystem::path& folder,
                                     const std::filesystem::path& photos);

// Every picture of a folder by name, focal length from EXIF.
Result<ImportedSet> PhotosAlone(const std::filesystem::path& photos,
                                std::optional<double> sensor_width_mm);

// jpg, png or tif for a file of that kind in any spelling, else empty.
std::string PlainExtension(const std::filesystem::path& path);

}  // namespace scan
