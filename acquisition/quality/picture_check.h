// Whether a picture file is whole.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace scan {

struct PictureSize {
  int w = 0, h = 0;
  friend bool operator==(const PictureSize&, const PictureSize&) = default;
};

// Decodes a jpg, png or tif in stored order (EXIF rotation ignored), looks for the end mark of jpg
// and png (decoders fill a cut picture silently), and looks at the head of raw files (dng, nef,
// cr2, arw), whose pixels are not decoded here. Returns what is wrong, or nothing; `size` receives
// the size where it is known. Thread contract: pure.
std::optional<std::string> FindPictureFault(std::string_view extension,
                                            std::span<const std::byte> bytes,
                                            std::optional<PictureSize>& size);

}  // namespace scan
