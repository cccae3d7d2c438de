#include "drivers/camera/v4l2/convert.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "drivers/camera/encode_picture.h"
#include "drivers/camera/jpeg_decode.h"

namespace scan {
namespace {

constexpr int kFraction = 16;  // bits behind the point

// The conversion in fixed point, one table a channel.
struct YcbcrTables {
  std::array<int, 256> y, r_cr, g_cb, g_cr, b_cb;
};

YcbcrTables TablesOf(const YcbcrConversion& c) {
  const auto fixed = [](double value) {
    return static_cast<int>(std::lround(value * (1 << kFraction)));
  };
  YcbcrTables t{};
  for (int v = 0; v < 256; ++v) {
    const auto i = static_cast<std::size_t>(v);
    t.y[i] = fixed(c.y_scale * (v - c.y_offset)) + (1 << (kFraction - 1));
    t.r_cr[i] = fixed(c.r_cr * (v - 128));
    t.g_cb[i] = fixed(c.g_cb * (v - 128));
    t.g_cr[i] = fixed(c.g_cr * (v - 128));
    t.b_cb[i] = fixed(c.b_cb * (v - 128));
  }
  return t;
}

std::uint8_t Clamp8(int fixed) {
  return static_cast<std::uint8_t>(std::clamp(fixed >> kFraction, 0, 255));
}

void PutPixel(const YcbcrTables& t, std::uint8_t y, std::uint8_t cb, std::uint8_t cr,
              std::uint8_t* bgr) {
  bgr[0] = Clamp8(t.y[y] + t.b_cb[cb]);
  bgr[1] = Clamp8(t.y[y] + t.g_cb[cb] + t.g_cr[cr]);
  bgr[2] = Clamp8(t.y[y] + t.r_cr[cr]);
}

std::uint8_t Mean(int a, int b) { return static_cast<std::uint8_t>((a + b + 1) / 2); }

cv::Mat View(const StreamFormat& format, std::span<const std::byte> bytes, int type, int rows) {
  // OpenCV has no read-only matrix; nobody writes to this one.
  return {rows, format.w, type, const_cast<std::byte*>(bytes.data()),
          static_cast<std::size_t>(format.bytes_per_line)};
}

cv::Mat FromYuyv(const StreamFormat& format, std::span<const std::byte> bytes) {
  const YcbcrTables tables = TablesOf(ConversionFor(format.matrix, format.full_range));
  cv::Mat bgr(format.h, format.w, CV_8UC3);
  for (int row = 0; row < format.h; ++row) {
    const auto* in =
        reinterpret_cast<const std::uint8_t*>(bytes.data()) +
        static_cast<std::size_t>(row) * static_cast<std::size_t>(format.bytes_per_line);
    std::uint8_t* out = bgr.ptr<std::uint8_t>(row);
    for (int x = 0; x < format.w; ++x) {
      const std::uint8_t* pair = in + 4 * (x / 2);
      std::uint8_t cb = pair[1], cr = pair[3];
      if (x % 2 == 1 && x + 1 < format.w) {
        cb = Mean(cb, pair[5]);
        cr = Mean(cr, pair[7]);
      }
      PutPixel(tables, in[2 * x], cb, cr, out + 3 * x);
    }
  }
  return bgr;
}

// Chroma of one picture row: a quarter from the farther of the two chroma rows about it.
std::vector<std::uint8_t> ChromaRow(const StreamFormat& format, const std::uint8_t* plane,
                                    int row) {
  const int rows = (format.h + 1) / 2;
  const int near = row / 2;
  const int far = std::clamp(row % 2 == 0 ? near - 1 : near + 1, 0, rows - 1);
  const auto line = static_cast<std::size_t>(format.bytes_per_line);
  const std::uint8_t* a = plane + static_cast<std::size_t>(near) * line;
  const std::uint8_t* b = plane + static_cast<std::size_t>(far) * line;
  std::vector<std::uint8_t> chroma(static_cast<std::size_t>((format.w + 1) / 2 * 2));
  for (std::size_t i = 0; i < chroma.size() && i < line; ++i)
    chroma[i] = static_cast<std::uint8_t>((3 * a[i] + b[i] + 2) / 4);
  return chroma;
}

cv::Mat FromNv12(const StreamFormat& format, std::span<const std::byte> bytes) {
  const YcbcrTables tables = TablesOf(ConversionFor(format.matrix, format.full_range));
  const auto line = static_cast<std::size_t>(format.bytes_per_line);
  const auto* y_plane = reinterpret_cast<const std::uint8_t*>(bytes.data());
  const std::uint8_t* c_plane = y_plane + line * static_cast<std::size_t>(format.h);
  cv::Mat bgr(format.h, format.w, CV_8UC3);
  for (int row = 0; row < format.h; ++row) {
    const std::vector<std::uint8_t> chroma = ChromaRow(format, c_plane, row);
    const std::uint8_t* y = y_plane + line * static_cast<std::size_t>(row);
    std::uint8_t* out = bgr.ptr<std::uint8_t>(row);
    for (int x = 0; x < format.w; ++x) {
      const auto at = static_cast<std::size_t>(x / 2 * 2);
      std::uint8_t cb = chroma[at], cr = chroma[at + 1];
      if (x % 2 == 1 && at + 3 < chroma.size()) {
        cb = Mean(cb, chroma[at + 2]);
        cr = Mean(cr, chroma[at + 3]);
      }
      PutPixel(tables, y[x], cb, cr, out + 3 * x);
    }
  }
  return bgr;
}

// MIPI CSI-2 packing: the high 8 bits of 4 (10-bit) or 2 (12-bit) samples, then their low bits.
cv::Mat Unpack(const StreamFormat& format, std::span<const std::byte> bytes) {
  const int bits = format.format->bits;
  const int group = bits == 10 ? 4 : 2, low = bits - 8;
  cv::Mat samples(format.h, format.w, CV_16U);
  for (int row = 0; row < format.h; ++row) {
    const auto* in =
        reinterpret_cast<const std::uint8_t*>(bytes.data()) +
        static_cast<std::size_t>(row) * static_cast<std::size_t>(format.bytes_per_line);
    auto* out = samples.ptr<std::uint16_t>(row);
    for (int x = 0; x < format.w; ++x) {
      const std::uint8_t* packed = in + (x / group) * (group + 1);
      const int k = x % group;
      const int value = (packed[k] << low) | ((packed[group] >> (k * low)) & ((1 << low) - 1));
      out[x] = static_cast<std::uint16_t>(value);
    }
  }
  return samples;
}

// Copied line by line: OpenCV needs lines of whole samples, and its edge-aware demosaicing (4.6)
// overlooks the padding of 8-bit lines.
cv::Mat CopySamples(const StreamFormat& format, std::span<const std::byte> bytes) {
  cv::Mat samples(format.h, format.w, format.format->bits > 8 ? CV_16U : CV_8U);
  for (int row = 0; row < format.h; ++row)
    std::memcpy(samples.ptr(row),
                bytes.data() +
                    static_cast<std::size_t>(row) * static_cast<std::size_t>(format.bytes_per_line),
                static_cast<std::size_t>(format.w) * samples.elemSize());
  return samples;
}

// OpenCV names a pattern by the second row, from its second pixel.
int DemosaicCode(BayerOrder order) {
  switch (order) {
    case BayerOrder::bggr:
      return cv::COLOR_BayerRG2BGR_EA;
    case BayerOrder::grbg:
      return cv::COLOR_BayerGB2BGR_EA;
    case BayerOrder::gbrg:
      return cv::COLOR_BayerGR2BGR_EA;
    default:
      return cv::COLOR_BayerBG2BGR_EA;
  }
}

cv::Mat FromSamples(const StreamFormat& format, std::span<const std::byte> bytes) {
  const PixelFormat& pixel = *format.format;
  cv::Mat samples = pixel.layout == PixelLayout::bayer_packed ? Unpack(format, bytes)
                                                              : CopySamples(format, bytes);
  if (pixel.bits > 8 && pixel.bits < 16) samples = samples * (1 << (16 - pixel.bits));
  cv::Mat bgr;
  cv::cvtColor(samples, bgr,
               pixel.order == BayerOrder::none ? cv::COLOR_GRAY2BGR : DemosaicCode(pixel.order));
  return bgr;
}

cv::Mat FromPlain(const StreamFormat& format, std::span<const std::byte> bytes) {
  switch (format.format->layout) {
    case PixelLayout::yuyv:
      return FromYuyv(format, bytes);
    case PixelLayout::nv12:
      return FromNv12(format, bytes);
    case PixelLayout::bgr:
      return View(format, bytes, CV_8UC3, format.h).clone();
    case PixelLayout::rgb: {
      cv::Mat bgr;
      cv::cvtColor(View(format, bytes, CV_8UC3, format.h), bgr, cv::COLOR_RGB2BGR);
      return bgr;
    }
    default:
      return FromSamples(format, bytes);
  }
}

}  // namespace

YcbcrConversion ConversionFor(YcbcrMatrix matrix, bool full_range) {
  double kr = 0.299, kb = 0.114;  // BT.601
  if (matrix == YcbcrMatrix::bt709) kr = 0.2126, kb = 0.0722;
  if (matrix == YcbcrMatrix::bt2020) kr = 0.2627, kb = 0.0593;
  if (matrix == YcbcrMatrix::smpte240m) kr = 0.212, kb = 0.087;
  const double kg = 1 - kr - kb;
  const double chroma = full_range ? 1.0 : 255.0 / 224;  // of Cb, Cr
  YcbcrConversion c;
  c.y_scale = full_range ? 1.0 : 255.0 / 219;
  c.y_offset = full_range ? 0 : 16;
  c.r_cr = chroma * 2 * (1 - kr);
  c.b_cb = chroma * 2 * (1 - kb);
  c.g_cr = -chroma * 2 * (1 - kr) * kr / kg;
  c.g_cb = -chroma * 2 * (1 - kb) * kb / kg;
  return c;
}

Result<cv::Mat> PictureOf(const StreamFormat& format, std::span<const std::byte> bytes) {
  if (format.format->layout == PixelLayout::mjpeg) return DecodeJpegStrictly(bytes);
  const std::size_t needed =
      PictureBytes(*format.format, format.w, format.h, format.bytes_per_line);
  if (bytes.size() < needed)
    return DeviceFault(fmt::format("the frame has {} of {} bytes", bytes.size(), needed), "camera",
                       "check cable, hub and power supply; a lower frame rate may help");
  try {
    return FromPlain(format, bytes);
  } catch (const cv::Exception& e) {
    return DeviceFault(e.what(), "camera", "choose another format");
  }
}

Result<EncodedFile> FileOf(const StreamFormat& format, std::span<const std::byte> bytes) {
  if (format.format->layout == PixelLayout::mjpeg) return JpegFileOf(bytes, format.w, format.h);
  SCAN_TRY(const cv::Mat picture, PictureOf(format, bytes));
  return EncodePicture(picture, "png", 95);
}

Result<std::optional<std::string>> AddFileOf(const StreamFormat& format,
                                             std::span<const std::byte> bytes, Frame& frame) {
  Result<EncodedFile> file = FileOf(format, bytes);
  if (!file && file.error().kind != ErrorKind::device) return tl::unexpected(file.error());
  if (!file) return std::move(file.error().what);
  frame.files.push_back(std::move(*file));
  return std::nullopt;
}

}  // namespace scan
