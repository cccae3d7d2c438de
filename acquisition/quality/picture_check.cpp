#include "acquisition/quality/picture_check.h"

#include <algorithm>
#include <array>
#include <opencv2/core.hpp>

#include "drivers/camera/decode_picture.h"

namespace scan {
namespace {

template <std::size_t N>
bool Contains(std::span<const std::byte> bytes, const std::array<unsigned char, N>& mark) {
  const auto same = [](std::byte a, unsigned char b) { return a == std::byte{b}; };
  return std::search(bytes.begin(), bytes.end(), mark.begin(), mark.end(), same) != bytes.end();
}

// The end mark, in the last bytes: some cameras pad a JPEG to a whole block.
bool HasEnd(std::string_view extension, std::span<const std::byte> bytes) {
  const auto tail = [&](std::size_t n) { return bytes.last(std::min(n, bytes.size())); };
  if (extension == "jpg") return Contains(tail(4096), std::array<unsigned char, 2>{0xff, 0xd9});
  if (extension == "png")
    return Contains(tail(12), std::array<unsigned char, 4>{'I', 'E', 'N', 'D'});
  return true;
}

bool IsRaw(std::string_view extension) {
  return extension == "dng" || extension == "nef" || extension == "cr2" || extension == "arw";
}

// All four are TIFF containers.
bool HasTiffHead(std::span<const std::byte> bytes) {
  const auto head = bytes.first(std::min<std::size_t>(4, bytes.size()));
  return Contains(head, std::array<unsigned char, 4>{'I', 'I', 42, 0}) ||
         Contains(head, std::array<unsigned char, 4>{'M', 'M', 0, 42});
}

}  // namespace

std::optional<std::string> FindPictureFault(std::string_view extension,
                                            std::span<const std::byte> bytes,
                                            std::optional<PictureSize>& size) {
  size.reset();
  const std::string name(extension);
  if (bytes.empty()) return "the " + name + " is empty";
  if (IsRaw(extension)) {
    if (!HasTiffHead(bytes)) return "the " + name + " has no TIFF head";
    return std::nullopt;
  }
  if (extension != "jpg" && extension != "png" && extension != "tif")
    return "'" + name + "' is no picture format of a session";
  if (!HasEnd(extension, bytes)) return "the " + name + " is cut off before its end mark";
  const auto picture = DecodePicture(extension, bytes);
  if (!picture) return "the " + name + " does not decode: " + picture.error().what;
  size = PictureSize{picture->cols, picture->rows};
  return std::nullopt;
}

}  // namespace scan
