// PNG pictures in memory, by libpng itself: OpenCV's reader of files brings more than a hundred
// shared libraries along, into programs that lock their memory.
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "drivers/base/result.h"

namespace scan {

// Without loss, fast rather than small. Precondition: CV_8UC3 or CV_16UC3, BGR, not empty.
// Errors: failed when the encoder fails. Thread contract: pure.
Result<std::vector<std::byte>> EncodePngFile(const cv::Mat& bgr);

// All of it, as CV_8UC3, BGR; of 16 bits the upper 8 are kept; behind what is transparent lies
// black.
// Errors: bad_input, with what is wrong. Thread contract: pure.
Result<cv::Mat> DecodePngFile(std::span<const std::byte> bytes);

}  // namespace scan
