// JPEG pictures of cameras, checked: their bytes are not trusted.
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <span>

#include "drivers/base/result.h"
#include "drivers/camera/camera.h"

namespace scan {

// Decodes all of it; cut off or damaged data are found, where plain decoders fill in grey.
// Bytes behind the picture's end are allowed (cameras pad to blocks). BGR, CV_8UC3.
// Errors: device, with what is wrong. Thread contract: pure.
Result<cv::Mat> DecodeJpegStrictly(std::span<const std::byte> bytes, std::size_t* used = nullptr);

// The picture as a file that every program reads: checked as above, of the size w x h, the padding
// cut off, and the standard Huffman tables put in where the camera left them out (as motion JPEG
// may). Errors: device. Thread contract: pure.
Result<EncodedFile> JpegFileOf(std::span<const std::byte> bytes, int w, int h);

}  // namespace scan
