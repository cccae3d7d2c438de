// The size of a picture without decoding it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "drivers/base/result.h"

namespace scan {

struct PictureHeader {
  int w = 0, h = 0;  // pixels in stored order; EXIF rotation is not applied
};

// PNG, JPEG and TIFF, known by their first bytes, and that the end of a PNG or JPEG is there.
// Errors: bad_input naming `where` for another format, a truncated or malformed file.
Result<PictureHeader> ReadPictureHeader(std::span<const std::byte> bytes, const std::string& where);
Result<PictureHeader> ReadPictureHeader(const std::filesystem::path& path);

}  // namespace scan
