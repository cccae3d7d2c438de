#include "reconstruction/masks/make_masks.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <map>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "drivers/base/files.h"
#include "reconstruction/masks/segmentation.h"

namespace scan {
namespace {

Status CheckOptions(const MaskOptions& o) {
  const bool good = o.band_px >= 1 && o.band_px <= 200 && o.smoothness >= 0 &&
                    o.smoothness <= 100 && o.noise_floor > 0 && o.keep_share >= 0 &&
                    o.keep_share <= 1 && o.min_hole_px >= 0 && o.grabcut_size_px >= 64;
  if (good) return {};
  return BadInput("an option is out of range", "mask options",
                  "see the ranges in reconstruction/masks/make_masks.h");
}

Status CheckPictures(const cv::Mat& photo, const cv::Mat& plate, const cv::Mat& ignore) {
  if (photo.type() != CV_8UC3 || photo.cols < 16 || photo.rows < 16) {
    return BadInput("the photograph is no 8-bit colour picture of at least 16 x 16 pixels",
                    "photograph", "give an 8-bit colour picture");
  }
  if (!plate.empty() && (plate.type() != CV_8UC3 || plate.size() != photo.size())) {
    return BadInput(fmt::format("the background plate is {} x {}, the photograph {} x {}",
                                plate.cols, plate.rows, photo.cols, photo.rows),
                    "background plate", "take both with the same camera settings, 8-bit colour");
  }
  if (!ignore.empty() && (ignore.type() != CV_8U || ignore.size() != photo.size())) {
    return BadInput(fmt::format("the ignore picture is {} x {}, the photograph {} x {}",
                                ignore.cols, ignore.rows, photo.cols, photo.rows),
                    "ignore picture", "give an 8-bit grey picture of the photograph's size");
  }
  return {};
}

Status CheckFound(const cv::Mat& labels) {
  const int found = cv::countNonZero(labels);
  if (found >= 16 && found <= 0.98 * static_cast<double>(labels.total())) return {};
  return Failed(found < 16 ? "no specimen stands out from the background"
                           : "nearly the whole picture differs from the background",
                "photograph", "check the light and the background plate, or give a mask");
}

cv::Mat LabelsFromPlate(const Difference& difference, const MaskOptions& options) {
  cv::Mat initial = difference.evidence > 0;
  MaskOptions specks = options;
  specks.keep_share = std::min(options.keep_share, 1e-4);
  CleanLabels(initial, specks);
  return CutBand(difference.evidence, difference.normalised, initial, options);
}

}  // namespace

Result<Mask> MakeMask(const cv::Mat& photo, const cv::Mat& plate, const cv::Mat& ignore,
                      const MaskOptions& options) try {
  SCAN_CHECK(CheckOptions(options));
  SCAN_CHECK(CheckPictures(photo, plate, ignore));
  Mask mask;
  mask.ignore = ignore.clone();
  const cv::Mat linear = LinearOf(photo);
  if (!plate.empty()) {
    const Difference difference = DifferenceToPlate(photo, plate, ignore, options.noise_floor);
    cv::Mat labels = LabelsFromPlate(difference, options);
    CleanLabels(labels, options);
    SCAN_CHECK(CheckFound(labels));
    // A pixel counts as specimen from about 5 % of it on, so the labels end outside the edge.
    mask.coverage = CoverageFromLabels(linear, difference.plate_linear, labels, 2, 3);
    return mask;
  }
  cv::Mat labels = GrabCutLabels(photo, ignore, options);
  CleanLabels(labels, options);
  SCAN_CHECK(CheckFound(labels));
  const int coarse_px =
      std::max(1, static_cast<int>(std::ceil(static_cast<double>(std::max(photo.cols, photo.rows)) /
                                             options.grabcut_size_px)));
  const int margin = coarse_px + 2;
  labels = CoverageFromLabels(linear, BackgroundFromPhoto(linear, labels, margin), labels, margin,
                              margin) > 127;
  CleanLabels(labels, options);
  SCAN_CHECK(CheckFound(labels));
  mask.coverage = CoverageFromLabels(linear, BackgroundFromPhoto(linear, labels, 3), labels, 2, 3);
  return mask;
} catch (const cv::Exception& exception) {
  return Failed(exception.what(), "photograph", "give a mask for this photograph");
}

Result<Mask> LoadMask(const std::filesystem::path& path, cv::Size size) try {
  cv::Mat picture = cv::imread(path.string(), cv::IMREAD_UNCHANGED | cv::IMREAD_IGNORE_ORIENTATION);
  if (picture.empty()) {
    return BadInput("the mask cannot be read", path.string(), "give an 8-bit PNG, JPEG or TIFF");
  }
  if (picture.depth() != CV_8U) {
    return BadInput("the mask is not 8-bit", path.string(), "save it with 8 bits a channel");
  }
  if (picture.size() != size) {
    return BadInput(fmt::format("the mask is {} x {}, its photograph {} x {}", picture.cols,
                                picture.rows, size.width, size.height),
                    path.string(), "give a mask of the photograph's size");
  }
  if (picture.channels() == 3) cv::cvtColor(picture, picture, cv::COLOR_BGR2GRAY);
  if (picture.channels() == 4) cv::cvtColor(picture, picture, cv::COLOR_BGRA2GRAY);
  if (picture.channels() == 2) cv::extractChannel(picture, picture, 0);
  Mask mask;
  double highest = 0;
  cv::minMaxLoc(picture, nullptr, &highest);
  const int between = cv::countNonZero(picture) - cv::countNonZero(picture == highest);
  mask.binary = between == 0;
  if (mask.binary) picture = picture > 0;
  mask.coverage = picture;
  return mask;
} catch (const cv::Exception& exception) {
  return BadInput(exception.what(), path.string(), "give an 8-bit PNG, JPEG or TIFF");
}

namespace {

Result<cv::Mat> ReadColour(const std::filesystem::path& path) {
  cv::Mat picture;
  try {
    picture = cv::imread(path.string(), cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    picture.release();
  }
  if (!picture.empty()) return picture;
  return BadInput("the picture cannot be read", path.string(), "give a whole PNG, JPEG or TIFF");
}

Result<cv::Mat> ReadIgnore(const Photo& photo, cv::Size size) {
  if (photo.ignore_path.empty()) return cv::Mat();
  SCAN_TRY(Mask mask, LoadMask(photo.ignore_path, size));
  return mask.coverage;
}

Result<Mask> MaskOf(const PhotoSet& set, const Photo& photo, const cv::Mat& plate,
                    const MaskOptions& options) {
  const Intrinsics& in = set.intrinsics(photo);
  const cv::Size size(in.w, in.h);
  SCAN_TRY(const cv::Mat ignore, ReadIgnore(photo, size));
  if (!photo.mask_path.empty()) {
    SCAN_TRY(Mask mask, LoadMask(photo.mask_path, size));
    mask.ignore = ignore;
    return mask;
  }
  SCAN_TRY(const cv::Mat picture, ReadColour(photo.path));
  if (picture.size() != size) {
    return BadInput(fmt::format("the photograph is {} x {}, its camera {} x {}", picture.cols,
                                picture.rows, in.w, in.h),
                    photo.path.string(), "set w and h of the camera to the photograph's size");
  }
  auto mask = MakeMask(picture, plate, ignore, options);
  if (!mask) mask.error().where = photo.path.string() + ", " + mask.error().where;
  return mask;
}

}  // namespace

Result<std::vector<Mask>> MakeMasks(const PhotoSet& set, const MaskOptions& options,
                                    const ProgressFn& progress, std::stop_token stop) {
  SCAN_CHECK(CheckOptions(options));
  std::map<std::filesystem::path, cv::Mat> plates;
  for (const Photo& photo : set.photos) {
    const auto& path = set.aims[photo.aim].background_plate;
    if (path.empty() || !photo.mask_path.empty() || plates.contains(path)) continue;
    SCAN_TRY(plates[path], ReadColour(path));
  }
  const std::size_t count = set.photos.size();
  std::vector<Result<Mask>> results(count, Result<Mask>(Mask{}));
  std::mutex reporting;
  std::size_t done = 0;
  auto make = [&](std::size_t i) {
    const Photo& photo = set.photos[i];
    const auto plate = plates.find(set.aims[photo.aim].background_plate);
    results[i] =
        stop.stop_requested()
            ? Result<Mask>(Cancelled("masks"))
            : MaskOf(set, photo, plate == plates.end() ? cv::Mat() : plate->second, options);
    const std::lock_guard lock(reporting);
    Report(progress, "masks", static_cast<double>(++done) / static_cast<double>(count));
  };
  auto serial = [&](const Photo& photo) {  // GrabCut draws on this thread's random numbers
    return photo.mask_path.empty() && set.aims[photo.aim].background_plate.empty();
  };
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    if (!serial(set.photos[i])) make(i);
  });
  for (std::size_t i = 0; i < count; ++i) {
    if (serial(set.photos[i])) make(i);
  }
  std::vector<Mask> masks;
  masks.reserve(count);
  for (auto& result : results) {
    if (!result) return tl::unexpected(std::move(result).error());
    masks.push_back(std::move(*result));
  }
  return masks;
}

Status SaveMasks(const PhotoSet& set, std::span<const Mask> masks) {
  assert(masks.size() == set.photos.size());
  const std::filesystem::path folder = set.session / "derived" / "masks";
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Failed(error.message(), folder.string(), "check the folder's permissions");
  for (std::size_t i = 0; i < masks.size(); ++i) {
    std::vector<uchar> png;
    if (!cv::imencode(".png", masks[i].coverage, png)) {
      return Failed("the mask cannot be encoded", set.photos[i].name, "make the mask again");
    }
    SCAN_CHECK(WriteFileDurably(folder / (set.photos[i].name + ".png"),
                                std::as_bytes(std::span<const uchar>(png))));
  }
  return {};
}

}  // namespace scan
