#include "drivers/camera/v4l2/pixel_format.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cerrno>

namespace scan {
namespace {

using L = PixelLayout;
using O = BayerOrder;

// In the order of preference among equal sizes.
constexpr PixelFormat kFormats[] = {
    {V4L2_PIX_FMT_SRGGB16, "RG16", L::bayer, 16, O::rggb},
    {V4L2_PIX_FMT_SBGGR16, "BYR2", L::bayer, 16, O::bggr},
    {V4L2_PIX_FMT_SGRBG16, "GR16", L::bayer, 16, O::grbg},
    {V4L2_PIX_FMT_SGBRG16, "GB16", L::bayer, 16, O::gbrg},
    {V4L2_PIX_FMT_SRGGB14, "RG14", L::bayer, 14, O::rggb},
    {V4L2_PIX_FMT_SBGGR14, "BG14", L::bayer, 14, O::bggr},
    {V4L2_PIX_FMT_SGRBG14, "GR14", L::bayer, 14, O::grbg},
    {V4L2_PIX_FMT_SGBRG14, "GB14", L::bayer, 14, O::gbrg},
    {V4L2_PIX_FMT_SRGGB12, "RG12", L::bayer, 12, O::rggb},
    {V4L2_PIX_FMT_SBGGR12, "BG12", L::bayer, 12, O::bggr},
    {V4L2_PIX_FMT_SGRBG12, "BA12", L::bayer, 12, O::grbg},
    {V4L2_PIX_FMT_SGBRG12, "GB12", L::bayer, 12, O::gbrg},
    {V4L2_PIX_FMT_SRGGB12P, "pRCC", L::bayer_packed, 12, O::rggb},
    {V4L2_PIX_FMT_SBGGR12P, "pBCC", L::bayer_packed, 12, O::bggr},
    {V4L2_PIX_FMT_SGRBG12P, "pgCC", L::bayer_packed, 12, O::grbg},
    {V4L2_PIX_FMT_SGBRG12P, "pGCC", L::bayer_packed, 12, O::gbrg},
    {V4L2_PIX_FMT_SRGGB10, "RG10", L::bayer, 10, O::rggb},
    {V4L2_PIX_FMT_SBGGR10, "BG10", L::bayer, 10, O::bggr},
    {V4L2_PIX_FMT_SGRBG10, "BA10", L::bayer, 10, O::grbg},
    {V4L2_PIX_FMT_SGBRG10, "GB10", L::bayer, 10, O::gbrg},
    {V4L2_PIX_FMT_SRGGB10P, "pRAA", L::bayer_packed, 10, O::rggb},
    {V4L2_PIX_FMT_SBGGR10P, "pBAA", L::bayer_packed, 10, O::bggr},
    {V4L2_PIX_FMT_SGRBG10P, "pgAA", L::bayer_packed, 10, O::grbg},
    {V4L2_PIX_FMT_SGBRG10P, "pGAA", L::bayer_packed, 10, O::gbrg},
    {V4L2_PIX_FMT_SRGGB8, "RGGB", L::bayer, 8, O::rggb},
    {V4L2_PIX_FMT_SBGGR8, "BA81", L::bayer, 8, O::bggr},
    {V4L2_PIX_FMT_SGRBG8, "GRBG", L::bayer, 8, O::grbg},
    {V4L2_PIX_FMT_SGBRG8, "GBRG", L::bayer, 8, O::gbrg},
    {V4L2_PIX_FMT_RGB24, "RGB3", L::rgb, 8, O::none},
    {V4L2_PIX_FMT_BGR24, "BGR3", L::bgr, 8, O::none},
    {V4L2_PIX_FMT_YUYV, "YUYV", L::yuyv, 8, O::none},
    {V4L2_PIX_FMT_NV12, "NV12", L::nv12, 8, O::none},
    {V4L2_PIX_FMT_MJPEG, "MJPG", L::mjpeg, 8, O::none},
    {V4L2_PIX_FMT_JPEG, "JPEG", L::mjpeg, 8, O::none},
    {V4L2_PIX_FMT_Y16, "Y16", L::grey, 16, O::none},
    {V4L2_PIX_FMT_GREY, "GREY", L::grey, 8, O::none},
};

// Pixels that share bytes are stored together, also where the width ends among them.
int WholeGroups(int w, int group) { return (w + group - 1) / group * group; }

std::int64_t NsOf(const v4l2_fract& seconds) {
  if (seconds.denominator == 0) return 0;
  return std::int64_t{seconds.numerator} * 1'000'000'000 / seconds.denominator;
}

std::vector<std::int64_t> ListIntervals(V4l2Device& device, std::uint32_t fourcc, int w, int h) {
  std::vector<std::int64_t> intervals;
  for (std::uint32_t i = 0;; ++i) {
    v4l2_frmivalenum entry{};
    entry.index = i;
    entry.pixel_format = fourcc;
    entry.width = static_cast<std::uint32_t>(w);
    entry.height = static_cast<std::uint32_t>(h);
    if (device.Try(VIDIOC_ENUM_FRAMEINTERVALS, &entry) < 0) break;  // not every device says
    if (entry.type == V4L2_FRMIVAL_TYPE_DISCRETE) {
      intervals.push_back(NsOf(entry.discrete));
      continue;
    }
    intervals.push_back(NsOf(entry.stepwise.min));
    intervals.push_back(NsOf(entry.stepwise.max));
    break;
  }
  std::sort(intervals.begin(), intervals.end());
  return intervals;
}

// EINVAL ends an enumeration; all else is a fault.
Result<bool> NextEntry(V4l2Device& device, unsigned long request, const char* name, void* entry) {
  const int result = device.Try(request, entry);
  if (result == -EINVAL || result == -ENOTTY) return false;
  if (result < 0) return tl::unexpected(V4l2Error(-result, name, device.Where()));
  return true;
}

Status ListSizes(V4l2Device& device, bool intervals, OfferedFormat& format) {
  const auto add = [&](std::uint32_t w, std::uint32_t h) {
    FrameSize size{static_cast<int>(w), static_cast<int>(h), {}};
    if (intervals) size.intervals_ns = ListIntervals(device, format.fourcc, size.w, size.h);
    format.sizes.push_back(std::move(size));
  };
  for (std::uint32_t i = 0;; ++i) {
    v4l2_frmsizeenum entry{};
    entry.index = i;
    entry.pixel_format = format.fourcc;
    SCAN_TRY(const bool more,
             NextEntry(device, VIDIOC_ENUM_FRAMESIZES, "VIDIOC_ENUM_FRAMESIZES", &entry));
    if (!more) return {};
    if (entry.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
      add(entry.discrete.width, entry.discrete.height);
      continue;
    }
    const auto& range = entry.stepwise;
    format.min_w = static_cast<int>(range.min_width);
    format.min_h = static_cast<int>(range.min_height);
    format.step_w = static_cast<int>(std::max(1U, range.step_width));
    format.step_h = static_cast<int>(std::max(1U, range.step_height));
    add(range.max_width, range.max_height);
    add(range.min_width, range.min_height);
    return {};
  }
}

bool InRange(const OfferedFormat& format, int w, int h) {
  if (format.step_w == 0 || format.sizes.empty()) return false;
  const FrameSize& largest = format.sizes.front();
  return w >= format.min_w && h >= format.min_h && w <= largest.w && h <= largest.h &&
         (w - format.min_w) % format.step_w == 0 && (h - format.min_h) % format.step_h == 0;
}

std::string DescribeOffer(const std::vector<OfferedFormat>& offered) {
  std::string text;
  for (const OfferedFormat& format : offered) {
    const bool known = FindPixelFormat(format.fourcc) != nullptr;
    text += FourccText(format.fourcc) + (known ? "" : " (not understood)");
    for (const FrameSize& size : format.sizes) text += fmt::format(" {}x{}", size.w, size.h);
    text += format.step_w > 0 ? " and between; " : "; ";
  }
  return text.empty() ? "nothing" : text.substr(0, text.size() - 2);
}

}  // namespace

const PixelFormat* FindPixelFormat(std::uint32_t fourcc) {
  const auto* found = std::find_if(std::begin(kFormats), std::end(kFormats),
                                   [&](const PixelFormat& f) { return f.fourcc == fourcc; });
  return found == std::end(kFormats) ? nullptr : found;
}

const PixelFormat* FindPixelFormat(std::string_view name) {
  const auto* found = std::find_if(std::begin(kFormats), std::end(kFormats),
                                   [&](const PixelFormat& f) { return f.name == name; });
  return found == std::end(kFormats) ? nullptr : found;
}

std::string FourccText(std::uint32_t fourcc) {
  std::string text;
  for (int shift = 0; shift < 32; shift += 8) text += static_cast<char>((fourcc >> shift) & 0x7fU);
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

int MinBytesPerLine(const PixelFormat& format, int w) {
  switch (format.layout) {
    case PixelLayout::mjpeg:
      return 0;
    case PixelLayout::yuyv:
      return 2 * WholeGroups(w, 2);
    case PixelLayout::nv12:
      return WholeGroups(w, 2);
    case PixelLayout::rgb:
    case PixelLayout::bgr:
      return 3 * w;
    case PixelLayout::grey:
    case PixelLayout::bayer:
      return format.bits > 8 ? 2 * w : w;
    case PixelLayout::bayer_packed:
      return WholeGroups(w, format.bits == 10 ? 4 : 2) * format.bits / 8;
  }
  return 0;
}

std::size_t PictureBytes(const PixelFormat& format, int w, int h, int bytes_per_line) {
  const auto line = static_cast<std::size_t>(std::max(bytes_per_line, MinBytesPerLine(format, w)));
  const auto lines = static_cast<std::size_t>(h);
  if (format.layout == PixelLayout::mjpeg) return 0;
  if (format.layout == PixelLayout::nv12) return line * lines + line * ((lines + 1) / 2);
  return line * lines;
}

Result<std::vector<OfferedFormat>> ListFormats(V4l2Device& device, bool intervals) {
  std::vector<OfferedFormat> offered;
  for (std::uint32_t i = 0;; ++i) {
    v4l2_fmtdesc entry{};
    entry.index = i;
    entry.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    SCAN_TRY(const bool more, NextEntry(device, VIDIOC_ENUM_FMT, "VIDIOC_ENUM_FMT", &entry));
    if (!more) return offered;
    OfferedFormat format;
    format.fourcc = entry.pixelformat;
    format.description = reinterpret_cast<const char*>(entry.description);
    SCAN_CHECK(ListSizes(device, intervals, format));
    offered.push_back(std::move(format));
  }
}

Result<FormatChoice> ChooseFormat(const std::vector<OfferedFormat>& offered, const FormatWish& wish,
                                  const std::string& where) {
  FormatChoice best;
  const auto consider = [&](const PixelFormat* format, int w, int h) {
    const auto area = [](int a, int b) { return std::int64_t{a} * b; };
    if (wish.w > 0 && (w != wish.w || h != wish.h)) return;
    const bool larger = !best.format || area(w, h) > area(best.w, best.h);
    const bool equal = best.format && area(w, h) == area(best.w, best.h);
    if (larger || (equal && format < best.format)) best = {format, w, h};  // the table's order
  };
  for (const OfferedFormat& offer : offered) {
    const PixelFormat* format = FindPixelFormat(offer.fourcc);
    if (!format || (!wish.format.empty() && wish.format != format->name)) continue;
    for (const FrameSize& size : offer.sizes) consider(format, size.w, size.h);
    if (wish.w > 0 && InRange(offer, wish.w, wish.h)) consider(format, wish.w, wish.h);
  }
  if (best.format) return best;
  return BadInput(fmt::format("the camera has no format {} of {}",
                              wish.format.empty() ? "known here" : "'" + wish.format + "'",
                              wish.w > 0 ? fmt::format("{}x{}", wish.w, wish.h) : "any size"),
                  where, "choose from what it offers: " + DescribeOffer(offered));
}

}  // namespace scan
