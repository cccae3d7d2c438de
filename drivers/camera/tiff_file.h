// TIFF pictures in memory, by libtiff itself (why: png_file.h).
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <span>

#include "drivers/base/result.h"

namespace scan {

// The first picture, all of it, as CV_8UC3, BGR, in stored order; of 16 bits the upper 8 are
// kept.
// Errors: bad_input, with what is wrong; failed without memory for it. Thread contract: pure.
Result<cv::Mat> DecodeTiffFile(std::span<const std::byte> bytes);

}  // namespace scan
