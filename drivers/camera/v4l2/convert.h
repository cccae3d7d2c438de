// From the bytes of a frame to a picture.
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>

#include "drivers/base/result.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/v4l2/v4l2_stream.h"

namespace scan {

// Rows of RGB from YCbCr in [0, 255]: rgb = matrix * (ycbcr - offset), 8-bit values.
struct YcbcrConversion {
  double y_scale = 1, y_offset = 0;
  double r_cr = 0, g_cb = 0, g_cr = 0, b_cb = 0;  // on Cb - 128 and Cr - 128, range included
};
// ITU-R BT.601, BT.709, BT.2020, SMPTE 240M: from their luma coefficients Kr and Kb.
YcbcrConversion ConversionFor(YcbcrMatrix matrix, bool full_range);

// BGR: CV_8UC3, or CV_16UC3 where a sample has more than 8 bits (scaled to the whole 16).
// YUYV and NV12 by the device's own matrix and range, chroma interpolated between its sites (taken
// as co-sited horizontally and centred vertically, as in MPEG-2). Bayer is interpolated along
// edges. The device's transfer function is taken as that of sRGB.
// Errors: device for too few bytes or a damaged JPEG. Thread contract: pure.
Result<cv::Mat> PictureOf(const StreamFormat& format, std::span<const std::byte> bytes);

// The frame as a file of a session: MJPEG as the camera made it (checked), all else as PNG without
// loss. Errors: as above. Thread contract: pure.
Result<EncodedFile> FileOf(const StreamFormat& format, std::span<const std::byte> bytes);

// Adds that file to `frame`; gives what is wrong with the bytes, if anything, for the caller to
// count. Errors: what is no fault of the bytes. Thread contract: pure.
Result<std::optional<std::string>> AddFileOf(const StreamFormat& format,
                                             std::span<const std::byte> bytes, Frame& frame);

}  // namespace scan
