#include "acquisition/session/picture_header.h"

#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>

#include "drivers/base/files.h"

namespace scan {
namespace {

constexpr std::uint32_t kMaxSide = 1 << 17;

// Integers at any place of the file; nothing beyond its end.
class Bytes {
 public:
  explicit Bytes(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::size_t size() const { return bytes_.size(); }
  bool StartsWith(std::string_view text) const {
    return bytes_.size() >= text.size() &&
           std::memcmp(bytes_.data(), text.data(), text.size()) == 0;
  }
  std::optional<std::uint32_t> Read(std::size_t at, int count, bool little_endian) const {
    if (at > size() || size() - at < static_cast<std::size_t>(count)) return std::nullopt;
    std::uint32_t value = 0;
    for (int i = 0; i < count; ++i) {
      const int shift = 8 * (little_endian ? i : count - 1 - i);
      value |= std::to_integer<std::uint32_t>(bytes_[at + static_cast<std::size_t>(i)]) << shift;
    }
    return value;
  }
  std::optional<std::uint32_t> Big(std::size_t at, int count) const {
    return Read(at, count, false);
  }
  std::string_view text() const {
    return {reinterpret_cast<const char*>(bytes_.data()), bytes_.size()};
  }

 private:
  std::span<const std::byte> bytes_;
};

using Size = std::optional<PictureHeader>;

Size MakeSize(std::optional<std::uint32_t> w, std::optional<std::uint32_t> h) {
  if (!w || !h || *w < 1 || *h < 1 || *w > kMaxSide || *h > kMaxSide) return std::nullopt;
  return PictureHeader{static_cast<int>(*w), static_cast<int>(*h)};
}

Size PngSize(const Bytes& bytes) {
  if (bytes.text().substr(0, 33).find("IHDR") != 12) return std::nullopt;
  const std::size_t tail = bytes.size() > 64 ? bytes.size() - 64 : 0;
  if (bytes.text().find("IEND", tail) == std::string_view::npos) return std::nullopt;
  return MakeSize(bytes.Big(16, 4), bytes.Big(20, 4));
}

// SOF0 to SOF15 without DHT, JPG and DAC.
bool IsStartOfFrame(std::uint32_t marker) {
  return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

Size JpegSize(const Bytes& bytes) {
  Size size;
  std::size_t at = 2;
  while (true) {
    const auto sync = bytes.Big(at, 1);
    auto marker = bytes.Big(at + 1, 1);
    while (sync == 0xffu && marker == 0xffu) marker = bytes.Big(++at + 1, 1);  // fill bytes
    const auto length = bytes.Big(at + 2, 2);
    if (sync != 0xffu || !marker || !length || *length < 2) return std::nullopt;
    if (IsStartOfFrame(*marker)) size = MakeSize(bytes.Big(at + 7, 2), bytes.Big(at + 5, 2));
    at += 2 + *length;
    if (*marker == 0xda) break;  // the picture's data begin: its end must follow
  }
  const std::size_t end = bytes.text().rfind("\xff\xd9");
  if (end == std::string_view::npos || end < at) return std::nullopt;
  return size;
}

Size TiffSize(const Bytes& bytes) {
  const bool little = bytes.StartsWith("II");
  const auto directory = bytes.Read(4, 4, little);
  if (!directory) return std::nullopt;
  const auto count = bytes.Read(*directory, 2, little);
  if (!count) return std::nullopt;
  std::optional<std::uint32_t> w, h;
  for (std::size_t i = 0; i < *count; ++i) {
    const std::size_t at = std::size_t{*directory} + 2 + 12 * i;
    const auto tag = bytes.Read(at, 2, little);
    const auto type = bytes.Read(at + 2, 2, little);
    if (!tag || !type) return std::nullopt;
    const int width = *type == 3 ? 2 : 4;  // SHORT or LONG
    if (*tag == 256) w = bytes.Read(at + 8, width, little);
    if (*tag == 257) h = bytes.Read(at + 8, width, little);
  }
  return MakeSize(w, h);
}

}  // namespace

Result<PictureHeader> ReadPictureHeader(std::span<const std::byte> data, const std::string& where) {
  const Bytes bytes(data);
  Size size;
  if (bytes.StartsWith("\x89PNG\r\n\x1a\n")) {
    size = PngSize(bytes);
  } else if (bytes.StartsWith("\xff\xd8\xff")) {
    size = JpegSize(bytes);
  } else if (bytes.StartsWith(std::string_view("II*\0", 4)) ||
             bytes.StartsWith(std::string_view("MM\0*", 4))) {
    size = TiffSize(bytes);
  } else {
    return BadInput("not a PNG, JPEG or TIFF picture", where, "convert it, or leave it out");
  }
  if (!size) return BadInput("a truncated or malformed picture", where, "copy it again");
  return *size;
}

Result<PictureHeader> ReadPictureHeader(const std::filesystem::path& path) {
  SCAN_TRY(const auto bytes, ReadBinaryFile(path));
  return ReadPictureHeader(bytes, path.string());
}

}  // namespace scan
