#include <fmt/format.h>
#include <libexif/exif-data.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "acquisition/import/sources.h"
#include "acquisition/session/picture_header.h"
#include "drivers/base/files.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

constexpr double kFocalSigmaOfExif = 0.1;         // relative
constexpr double kFilmDiagonal_mm = 43.26661530;  // of 36 x 24 mm

using Exif = std::unique_ptr<ExifData, decltype(&exif_data_unref)>;

// A positive number of the main picture's tags; 0 where it is missing or makes no sense.
double Tag(ExifData* exif, ExifTag tag) {
  const ExifEntry* entry = exif_content_get_entry(exif->ifd[EXIF_IFD_EXIF], tag);
  if (!entry || !entry->data) return 0;
  const ExifByteOrder order = exif_data_get_byte_order(exif);
  double value = 0;
  if (entry->format == EXIF_FORMAT_SHORT && entry->size >= 2) {
    value = exif_get_short(entry->data, order);
  } else if (entry->format == EXIF_FORMAT_RATIONAL && entry->size >= 8) {
    const ExifRational ratio = exif_get_rational(entry->data, order);
    if (ratio.denominator != 0) value = static_cast<double>(ratio.numerator) / ratio.denominator;
  }
  return std::isfinite(value) && value > 0 ? value : 0;
}

// The 35 mm equivalent keeps the diagonal angle of view (CIPA DCG-001).
double FocalLengthPx(ExifData* exif, const PictureHeader& header,
                     std::optional<double> sensor_width_mm) {
  const double focal_mm = Tag(exif, EXIF_TAG_FOCAL_LENGTH);
  if (focal_mm > 0 && sensor_width_mm) return focal_mm / *sensor_width_mm * header.w;
  const double film_mm = Tag(exif, EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM);
  return film_mm / kFilmDiagonal_mm * std::hypot(header.w, header.h);
}

}  // namespace

std::string PlainExtension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  if (extension == ".jpg" || extension == ".jpeg") return "jpg";
  if (extension == ".tif" || extension == ".tiff") return "tif";
  return extension == ".png" ? "png" : "";
}

Result<ImportedSet> PhotosAlone(const fs::path& photos, std::optional<double> sensor_width_mm) {
  std::vector<fs::path> paths;
  std::error_code code;
  for (fs::directory_iterator at(photos, code), end; !code && at != end; at.increment(code))
    if (at->is_regular_file(code) && !PlainExtension(at->path()).empty())
      paths.push_back(at->path());
  if (code)
    return BadInput("cannot list the folder (" + code.message() + ")", photos.string(),
                    "name a folder of photographs");
  if (paths.empty())
    return BadInput("no JPEG, PNG or TIFF photograph", photos.string(),
                    "name a folder that has some; develop RAW files first");
  std::sort(paths.begin(), paths.end());
  ImportedSet set;
  for (const auto& path : paths) {
    ImportedPhoto photo;
    photo.path = path;
    SCAN_TRY(const auto bytes, ReadBinaryFile(path));
    SCAN_TRY(const PictureHeader header, ReadPictureHeader(bytes, path.string()));
    const Exif exif(exif_data_new_from_data(reinterpret_cast<const unsigned char*>(bytes.data()),
                                            static_cast<unsigned>(bytes.size())),
                    exif_data_unref);
    const double focal_px = exif ? FocalLengthPx(exif.get(), header, sensor_width_mm) : 0;
    if (!(focal_px > 0))
      return BadInput("nothing tells the focal length of the photograph", path.string(),
                      "give --transforms with fl_x, or --sensor-width-mm where its EXIF has a "
                      "focal length in mm");
    photo.intrinsics.w = header.w;
    photo.intrinsics.h = header.h;
    photo.intrinsics.fl_x = photo.intrinsics.fl_y = focal_px;
    photo.intrinsics.cx = 0.5 * header.w;
    photo.intrinsics.cy = 0.5 * header.h;
    photo.sigma.fl_rel = kFocalSigmaOfExif;
    set.photos.push_back(std::move(photo));
  }
  return set;
}

}  // namespace scan
