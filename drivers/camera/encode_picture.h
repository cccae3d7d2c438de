// Pictures as files in memory.
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "drivers/base/result.h"
#include "drivers/camera/camera.h"

namespace scan {

// `format` jpg: baseline JPEG without chroma subsampling (4:4:4), which OpenCV's own encoder cannot
// be asked for; png: without loss, fast. Precondition: CV_8UC3 (png also CV_16UC3), BGR, not empty;
// quality 1 to 100.
// Errors: bad_input for another format; failed when the encoder fails. Thread contract: pure.
Result<EncodedFile> EncodePicture(const cv::Mat& bgr, const std::string& format, int jpeg_quality);

}  // namespace scan
