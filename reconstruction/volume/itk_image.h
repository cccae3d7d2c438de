// What the readers of single files, slices and DICOM series share; ITK stays in .cpp files.
#pragma once

#include <filesystem>
#include <vector>

#include "drivers/base/result.h"
#include "reconstruction/volume/volume.h"

namespace scan {

enum class VolumeFormat { metaimage, nrrd, nifti, tiff, png };

// A volume and whether its file states a voxel size.
struct FileVolume {
  Volume volume;
  bool has_spacing = false;
};

Result<FileVolume> ReadVolumeFile(const std::filesystem::path& path, VolumeFormat format);

// Slices in the given order. Precondition: at least one.
Result<FileVolume> ReadSlices(const std::vector<std::filesystem::path>& slices,
                              VolumeFormat format);

// The one DICOM series of a folder.
Result<FileVolume> ReadDicomSeries(const std::filesystem::path& folder);

}  // namespace scan
