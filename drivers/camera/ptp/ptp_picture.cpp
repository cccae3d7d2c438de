#include "drivers/camera/ptp/ptp_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <set>
#include <span>
#include <utility>

namespace scan {
namespace {

constexpr std::array<std::string_view, 6> kKinds{"jpg", "tif", "dng", "nef", "cr2", "arw"};
constexpr std::size_t kPadding = 1 << 16;  // cameras may fill up behind a picture's end

std::size_t ByteAt(std::span<const std::byte> bytes, std::size_t at) {
  return std::to_integer<std::size_t>(bytes[at]);
}

struct JpegLayout {
  std::optional<std::pair<int, int>> size;
  std::size_t scan_at = 0;  // of the compressed data
};

// Size by the first frame header (ISO 10918-1, B.2.2), and where the first scan begins; the
// thumbnail of the EXIF data lies within a segment before and is passed over with it. Nothing where
// there is no scan.
std::optional<JpegLayout> JpegLayoutOf(std::span<const std::byte> bytes) {
  if (bytes.size() < 4 || ByteAt(bytes, 0) != 0xff || ByteAt(bytes, 1) != 0xd8) return std::nullopt;
  JpegLayout layout;
  std::size_t at = 2;
  while (at + 9 < bytes.size() && ByteAt(bytes, at) == 0xff) {
    const std::size_t marker = ByteAt(bytes, at + 1);
    if (marker == 0xff) {  // fill byte
      ++at;
      continue;
    }
    const bool frame_header =
        marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame_header && !layout.size) {
      const auto h = ByteAt(bytes, at + 5) << 8 | ByteAt(bytes, at + 6);
      const auto w = ByteAt(bytes, at + 7) << 8 | ByteAt(bytes, at + 8);
      layout.size = std::pair(static_cast<int>(w), static_cast<int>(h));
    }
    if (marker == 0xd9) return std::nullopt;
    at += 2 + (ByteAt(bytes, at + 2) << 8 | ByteAt(bytes, at + 3));
    layout.scan_at = at;
    if (marker == 0xda) return layout;
  }
  return std::nullopt;
}

// A thumbnail's end, before the scan, is not the picture's.
bool JpegEnds(std::span<const std::byte> bytes, std::size_t scan_at) {
  const std::size_t last =
      std::max(scan_at + 1, bytes.size() > kPadding ? bytes.size() - kPadding : 0);
  for (std::size_t at = bytes.size(); at-- > last;) {
    if (ByteAt(bytes, at) == 0xd9 && ByteAt(bytes, at - 1) == 0xff) return true;
  }
  return false;
}

bool IsTiff(std::span<const std::byte> bytes) {
  if (bytes.size() < 8) return false;
  const auto a = ByteAt(bytes, 0), b = ByteAt(bytes, 1);
  return (a == 'I' && b == 'I' && ByteAt(bytes, 2) == 42) ||
         (a == 'M' && b == 'M' && ByteAt(bytes, 3) == 42);
}

std::string StemOf(const PhotoFile& file) { return file.name.substr(0, file.name.rfind('.')); }

}  // namespace

Result<std::string> PictureExtension(const PhotoFile& file, const std::string& where) {
  const std::size_t dot = file.name.rfind('.');
  std::string extension = dot == std::string::npos ? "" : file.name.substr(dot + 1);
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension == "jpeg") extension = "jpg";
  if (extension == "tiff") extension = "tif";
  if (std::find(kKinds.begin(), kKinds.end(), extension) != kKinds.end()) return extension;
  return DeviceFault(fmt::format("'{}' is no picture that a session keeps", file.name), where,
                     "choose JPEG, or JPEG and one of NEF, CR2, ARW, DNG on the camera");
}

Status CheckOneExposure(const std::vector<PhotoFile>& files, const std::string& where) {
  std::set<std::string> kinds;
  for (const PhotoFile& file : files) {
    SCAN_TRY(const std::string kind, PictureExtension(file, where));
    const bool same_name =
        StemOf(file) == StemOf(files.front()) ||
        (file.name.starts_with("capt") && files.front().name.starts_with("capt"));
    if (!kinds.insert(kind).second || !same_name)
      return DeviceFault(
          fmt::format("{} and {} are not of one exposure", files.front().name, file.name), where,
          "single frames, no bracketing; nobody else may release the camera");
  }
  return {};
}

Status CheckPicture(const EncodedFile& file, int w, int h, const std::string& where) {
  const auto fault = [&](std::string what) {
    return DeviceFault(std::move(what), where, "check cable and card, and take the picture again");
  };
  if (file.extension != "jpg") {
    if (!IsTiff(file.bytes)) return fault(fmt::format("the {} file is damaged", file.extension));
    return {};
  }
  const auto layout = JpegLayoutOf(file.bytes);
  if (!layout || !layout->size || !JpegEnds(file.bytes, layout->scan_at))
    return fault("the JPEG is damaged or cut off");
  const auto size = layout->size;
  if (w > 0 && *size != std::pair(w, h))
    return DeviceFault(
        fmt::format("the JPEG has {} x {} pixels, not {} x {}", size->first, size->second, w, h),
        where, "set the largest picture size on the camera, and width_px, height_px");
  return {};
}

}  // namespace scan
