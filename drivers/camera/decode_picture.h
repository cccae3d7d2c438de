// Pictures from files in memory.
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <span>
#include <string_view>

#include "drivers/base/result.h"

namespace scan {

// A jpg, png or tif, all of it, in stored order (EXIF rotation ignored): CV_8UC3, BGR. Damaged JPEG
// data are found, where plain decoders fill in grey.
// Errors: bad_input for another format or a file that does not decode (device for a JPEG).
// Thread contract: pure.
Result<cv::Mat> DecodePicture(std::string_view extension, std::span<const std::byte> bytes);

}  // namespace scan
