// The picture formats of V4L2 that become pictures here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/base/result.h"
#include "drivers/camera/v4l2/v4l2_device.h"

namespace scan {

enum class PixelLayout { mjpeg, yuyv, nv12, grey, rgb, bgr, bayer, bayer_packed };
enum class BayerOrder { none, rggb, bggr, grbg, gbrg };  // first two rows, from the left

struct PixelFormat {
  std::uint32_t fourcc = 0;
  const char* name = "";  // as people write it: MJPG YUYV NV12 ...
  PixelLayout layout = PixelLayout::yuyv;
  int bits = 8;  // of a sample
  BayerOrder order = BayerOrder::none;
};

const PixelFormat* FindPixelFormat(std::uint32_t fourcc);
const PixelFormat* FindPixelFormat(std::string_view name);
std::string FourccText(std::uint32_t fourcc);

// Bytes of a whole picture with this line length (0: lines without padding); 0 for MJPEG.
std::size_t PictureBytes(const PixelFormat& format, int w, int h, int bytes_per_line);
int MinBytesPerLine(const PixelFormat& format, int w);

// One size that the device offers in one format.
struct FrameSize {
  int w = 0, h = 0;
  std::vector<std::int64_t> intervals_ns;  // ascending; empty where the device does not say
};

struct OfferedFormat {
  std::uint32_t fourcc = 0;
  std::string description;
  std::vector<FrameSize> sizes;  // of a stepwise range only the largest and the smallest
  // Of a stepwise range; a step of 0: only the listed sizes.
  int min_w = 0, min_h = 0, step_w = 0, step_h = 0;
};

// Everything the device offers, also what is not understood here; frame intervals only on request
// (some drivers list hundreds). Errors: device.
Result<std::vector<OfferedFormat>> ListFormats(V4l2Device& device, bool intervals);

struct FormatWish {
  std::string format;            // empty: any
  int w = 0, h = 0;              // 0: the largest
  std::int64_t interval_ns = 0;  // 0: as the device has it
  friend bool operator==(const FormatWish&, const FormatWish&) = default;
};

struct FormatChoice {
  const PixelFormat* format = nullptr;  // never null
  int w = 0, h = 0;
};

// The largest size that fits; among equals what keeps most of the sensor's values (Bayer of many
// bits first, MJPEG after all other colour formats, grey last).
// Errors: bad_input, with what is offered.
Result<FormatChoice> ChooseFormat(const std::vector<OfferedFormat>& offered, const FormatWish& wish,
                                  const std::string& where);

}  // namespace scan
