// CT volumes in the formats that scanners and people use.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>

#include "drivers/base/result.h"
#include "reconstruction/volume/volume.h"

namespace scan {

struct ReadVolumeOptions {
  // Voxel size along i, j, k in mm; overrides the file's. Required where the file states none.
  std::optional<Eigen::Vector3d> voxel_mm;
};

// Reads NRRD (.nrrd .nhdr), MetaImage (.mha .mhd), NIfTI (.nii .nii.gz), multi-page TIFF, a folder
// of PNG or TIFF slices (natural order of their names) or a folder with one DICOM series; any
// scalar type. ITK's physical space (LPS), mm. TIFF, PNG, and headers without a spacing need
// `voxel_mm`; their origin is the first voxel's centre. Errors: bad_input for a missing,
// unreadable, truncated or empty file, slices of different sizes, colour, NaN or infinite grey
// values, no voxel size, fewer than 2 voxels along an axis, more voxels than the memory holds.
// Thread contract: pure.
Result<Volume> ReadVolume(const std::filesystem::path& path, const ReadVolumeOptions& options = {});

}  // namespace scan
