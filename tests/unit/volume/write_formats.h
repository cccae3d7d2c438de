// Volumes in every format that is read, written by ITK itself.
#pragma once

#include <filesystem>

#include "reconstruction/volume/volume.h"

namespace scan {

enum class Scalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

// .mha, .mhd, .nrrd, .nii, .nii.gz or .tif (multi-page) by extension.
void WriteWithItk(const std::filesystem::path& path, const Volume& volume, Scalar scalar);

// Three values a voxel.
void WriteColour(const std::filesystem::path& path);

// 2D slices PREFIX0, PREFIX1, ... PREFIX10 with the extension, 8-bit.
void WriteSlices(const std::filesystem::path& folder, const Volume& volume,
                 const std::string& extension);

// One DICOM series of int16 slices, named against their order.
void WriteDicom(const std::filesystem::path& folder, const Volume& volume);

}  // namespace scan
