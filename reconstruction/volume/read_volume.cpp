#include "reconstruction/volume/read_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string>
#include <vector>

#include "reconstruction/volume/itk_image.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

std::string LowerExtension(const fs::path& path) {
  std::string text = path.extension().string();
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::optional<VolumeFormat> FormatOf(const fs::path& path) {
  const std::string extension = LowerExtension(path);
  if (extension == ".mha" || extension == ".mhd") return VolumeFormat::metaimage;
  if (extension == ".nrrd" || extension == ".nhdr") return VolumeFormat::nrrd;
  if (extension == ".nii") return VolumeFormat::nifti;
  if (extension == ".gz" && LowerExtension(path.stem()) == ".nii") return VolumeFormat::nifti;
  if (extension == ".tif" || extension == ".tiff") return VolumeFormat::tiff;
  if (extension == ".png") return VolumeFormat::png;
  return {};
}

// slice_2 before slice_10: digits compare as numbers.
bool NaturalLess(const std::string& a, const std::string& b) {
  const auto digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!digit(a[i]) || !digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    while (i < a.size() && a[i] == '0') ++i;
    while (j < b.size() && b[j] == '0') ++j;
    std::size_t m = i, n = j;
    while (m < a.size() && digit(a[m])) ++m;
    while (n < b.size() && digit(b[n])) ++n;
    if (m - i != n - j) return m - i < n - j;
    if (const int order = a.compare(i, m - i, b, j, n - j); order != 0) return order < 0;
    i = m, j = n;
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;
}

Result<FileVolume> ReadFolder(const fs::path& folder) {
  std::vector<fs::path> png, tiff;
  std::error_code code;
  for (const auto& entry : fs::directory_iterator(folder, code)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with('.') || entry.is_directory(code)) continue;
    const auto format = FormatOf(entry.path());
    if (format == VolumeFormat::png) png.push_back(entry.path());
    if (format == VolumeFormat::tiff) tiff.push_back(entry.path());
  }
  if (code)
    return BadInput("the folder cannot be read (" + code.message() + ")", folder.string(),
                    "check its rights");
  if (!png.empty() && !tiff.empty())
    return BadInput("the folder holds both PNG and TIFF files", folder.string(),
                    "keep only the slices of one volume in it");
  if (png.empty() && tiff.empty()) return ReadDicomSeries(folder);
  auto& slices = png.empty() ? tiff : png;
  std::sort(slices.begin(), slices.end(), [](const fs::path& a, const fs::path& b) {
    return NaturalLess(a.filename().string(), b.filename().string());
  });
  return ReadSlices(slices, png.empty() ? VolumeFormat::tiff : VolumeFormat::png);
}

Status ApplySpacing(const ReadVolumeOptions& options, const fs::path& path, FileVolume& file) {
  Volume& volume = file.volume;
  if (options.voxel_mm) {
    volume.spacing_mm = *options.voxel_mm;
  } else if (!file.has_spacing) {
    return BadInput("the file states no voxel size", path.string(),
                    "give it in mm with --voxel-mm X or X,Y,Z");
  }
  if (!(volume.spacing_mm.minCoeff() > 0) || !volume.spacing_mm.allFinite())
    return BadInput(fmt::format("voxel size {:g} x {:g} x {:g} mm", volume.spacing_mm[0],
                                volume.spacing_mm[1], volume.spacing_mm[2]),
                    path.string(), "give a positive one with --voxel-mm X or X,Y,Z");
  return {};
}

Status CheckGreyValues(const Volume& volume, const fs::path& path) {
  if (std::min({volume.size[0], volume.size[1], volume.size[2]}) < 2)
    return BadInput(fmt::format("a volume of {} x {} x {} voxels", volume.size[0], volume.size[1],
                                volume.size[2]),
                    path.string(), "a volume needs at least 2 voxels along every axis");
  for (std::size_t v = 0; v < volume.grey.size(); ++v)
    if (!std::isfinite(volume.grey[v]))
      return BadInput(
          fmt::format("NaN or infinite grey value at voxel ({}, {}, {})", v % volume.size[0],
                      v / volume.size[0] % volume.size[1], v / (volume.size[0] * volume.size[1])),
          path.string(), "replace it by the grey value of air");
  return {};
}

}  // namespace

Result<Volume> ReadVolume(const fs::path& path, const ReadVolumeOptions& options) {
  std::error_code code;
  if (!fs::exists(path, code))
    return BadInput("no such file or folder", path.string(), "check the path");
  FileVolume file;
  if (fs::is_directory(path, code)) {
    SCAN_TRY(file, ReadFolder(path));
  } else {
    const auto format = FormatOf(path);
    if (!format)
      return BadInput("unknown volume format", path.string(),
                      "use .nrrd, .mha, .nii.gz, .tif or a folder of PNG, TIFF or DICOM slices");
    if (fs::file_size(path, code) == 0)
      return BadInput("the file is empty", path.string(), "copy it again");
    SCAN_TRY(file, ReadVolumeFile(path, *format));
  }
  SCAN_CHECK(ApplySpacing(options, path, file));
  SCAN_CHECK(CheckGreyValues(file.volume, path));
  return std::move(file.volume);
}

}  // namespace scan
