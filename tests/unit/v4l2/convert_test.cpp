#include "drivers/camera/v4l2/convert.h"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace scan {
namespace {

StreamFormat FormatNamed(const char* name, int w, int h, int padding = 0) {
  StreamFormat format;
  format.format = FindPixelFormat(name);
  EXPECT_NE(format.format, nullptr) << name;
  format.w = w;
  format.h = h;
  format.bytes_per_line = MinBytesPerLine(*format.format, w) + padding;
  format.size_image = PictureBytes(*format.format, w, h, format.bytes_per_line);
  return format;
}

std::span<const std::byte> Bytes(const std::vector<std::uint8_t>& v) {
  return std::as_bytes(std::span(v));
}

struct LumaWeights {
  YcbcrMatrix matrix;
  double kr, kb;
};
constexpr LumaWeights kWeights[] = {{YcbcrMatrix::bt601, 0.299, 0.114},
                                    {YcbcrMatrix::bt709, 0.2126, 0.0722},
                                    {YcbcrMatrix::bt2020, 0.2627, 0.0593},
                                    {YcbcrMatrix::smpte240m, 0.212, 0.087}};

// The forward transform of the standards, by itself.
std::array<std::uint8_t, 3> YcbcrOf(const cv::Vec3b& bgr, const LumaWeights& weights, bool full) {
  const double b = bgr[0] / 255.0, g = bgr[1] / 255.0, r = bgr[2] / 255.0;
  const double y = weights.kr * r + (1 - weights.kr - weights.kb) * g + weights.kb * b;
  const double cb = (b - y) / (2 * (1 - weights.kb)), cr = (r - y) / (2 * (1 - weights.kr));
  const auto byte = [](double v) {
    return static_cast<std::uint8_t>(std::lround(std::min(255.0, std::max(0.0, v))));
  };
  if (full) return {byte(255 * y), byte(128 + 255 * cb), byte(128 + 255 * cr)};
  return {byte(16 + 219 * y), byte(128 + 224 * cb), byte(128 + 224 * cr)};
}

const cv::Vec3b kColours[] = {{0, 0, 0},     {255, 255, 255}, {200, 30, 40}, {20, 180, 60},
                              {60, 60, 220}, {128, 128, 128}, {10, 200, 220}};

void ExpectColour(const cv::Mat& picture, const cv::Vec3b& expected) {
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x)
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(picture.at<cv::Vec3b>(y, x)[c], expected[c], 2) << x << " " << y << " " << c;
}

TEST(Convert, YuyvAndNv12GiveTheColoursOfEveryMatrixAndRange) {
  for (const LumaWeights& weights : kWeights) {
    for (const bool full : {false, true}) {
      for (const cv::Vec3b& colour : kColours) {
        const auto [y, cb, cr] = YcbcrOf(colour, weights, full);
        for (const char* name : {"YUYV", "NV12"}) {
          StreamFormat format = FormatNamed(name, 6, 4, 2);
          format.matrix = weights.matrix;
          format.full_range = full;
          std::vector<std::uint8_t> bytes(format.size_image, 77);
          for (int row = 0; row < 4; ++row)
            for (int x = 0; x < 6; ++x) {
              const auto line = static_cast<std::size_t>(row * format.bytes_per_line);
              const auto at = static_cast<std::size_t>(x);
              if (format.format->layout == PixelLayout::yuyv) {
                bytes[line + 2 * at] = y;
                bytes[line + 2 * at + 1] = x % 2 == 0 ? cb : cr;
              } else {
                bytes[line + at] = y;
                const auto chroma = static_cast<std::size_t>((4 + row / 2) * format.bytes_per_line);
                bytes[chroma + at] = x % 2 == 0 ? cb : cr;
              }
            }
          const auto picture = PictureOf(format, Bytes(bytes));
          ASSERT_TRUE(picture) << ToString(picture.error());
          ExpectColour(*picture, colour);
        }
      }
    }
  }
}

TEST(Convert, AnOddWidthEndsWithinAGroupOfPixels) {
  for (const char* name : {"YUYV", "NV12"}) {
    StreamFormat format = FormatNamed(name, 5, 2);
    format.full_range = true;
    std::vector<std::uint8_t> bytes(format.size_image, 100);  // Y
    const bool yuyv = format.format->layout == PixelLayout::yuyv;
    const std::size_t from = yuyv ? 0 : 2 * static_cast<std::size_t>(format.bytes_per_line);
    for (std::size_t cb = from + (yuyv ? 1 : 0), step = yuyv ? 4 : 2; cb < bytes.size(); cb += step)
      bytes[cb] = 160;
    for (std::size_t cr = from + (yuyv ? 3 : 1), step = yuyv ? 4 : 2; cr < bytes.size(); cr += step)
      bytes[cr] = 90;
    const auto picture = PictureOf(format, Bytes(bytes));
    ASSERT_TRUE(picture) << ToString(picture.error());
    // BT.601: B = Y + 1.772 (Cb - 128), R = Y + 1.402 (Cr - 128).
    ExpectColour(*picture, {157, 116, 47});
  }
}

TEST(Convert, LimitedBt601AgreesWithOpenCvOnLuma) {
  StreamFormat format = FormatNamed("YUYV", 256, 1);
  std::vector<std::uint8_t> bytes(512, 128);
  for (std::size_t x = 0; x < 256; ++x) bytes[2 * x] = static_cast<std::uint8_t>(x);
  const auto picture = PictureOf(format, Bytes(bytes));
  ASSERT_TRUE(picture);
  cv::Mat reference;
  cv::cvtColor(cv::Mat(1, 256, CV_8UC2, bytes.data()), reference, cv::COLOR_YUV2BGR_YUY2);
  EXPECT_LE(cv::norm(*picture, reference, cv::NORM_INF), 1);
}

TEST(Convert, ChromaBetweenItsSitesIsTheirMean) {
  StreamFormat format = FormatNamed("YUYV", 4, 1);
  format.full_range = true;
  const std::vector<std::uint8_t> bytes = {100, 100, 100, 128, 100, 140, 100, 128};
  const auto picture = PictureOf(format, Bytes(bytes));
  ASSERT_TRUE(picture);
  const auto blue = [&](int x) { return int{picture->at<cv::Vec3b>(0, x)[0]}; };
  EXPECT_NEAR(blue(1), (blue(0) + blue(2)) / 2, 1);
  EXPECT_EQ(blue(3), blue(2));
}

TEST(Convert, RgbBgrAndGreyKeepTheirOrderAndPadding) {
  const std::vector<std::uint8_t> bytes = {1, 2, 3, 4, 5, 6, 0, 0, 7, 8, 9, 10, 11, 12, 0, 0};
  const auto rgb = PictureOf(FormatNamed("RGB3", 2, 2, 2), Bytes(bytes));
  const auto bgr = PictureOf(FormatNamed("BGR3", 2, 2, 2), Bytes(bytes));
  ASSERT_TRUE(rgb && bgr);
  EXPECT_EQ(rgb->at<cv::Vec3b>(1, 1), cv::Vec3b(12, 11, 10));
  EXPECT_EQ(bgr->at<cv::Vec3b>(1, 1), cv::Vec3b(10, 11, 12));
  const auto grey = PictureOf(FormatNamed("GREY", 6, 2, 2), Bytes(bytes));
  ASSERT_TRUE(grey);
  EXPECT_EQ(grey->at<cv::Vec3b>(1, 5), cv::Vec3b(12, 12, 12));
}

// A mosaic of one colour: R 20, G 120, B 200 of 255, in the format's own bits.
class Bayer : public ::testing::TestWithParam<const char*> {};

TEST_P(Bayer, AMosaicOfOneColourGivesThatColour) {
  constexpr int kW = 16, kH = 8;
  const StreamFormat format = FormatNamed(GetParam(), kW, kH, 3);
  const PixelFormat& pixel = *format.format;
  const char* order = pixel.order == BayerOrder::rggb   ? "RGGB"
                      : pixel.order == BayerOrder::bggr ? "BGGR"
                      : pixel.order == BayerOrder::grbg ? "GRBG"
                                                        : "GBRG";
  const auto level = [&](char c) {
    const int of255 = c == 'R' ? 20 : c == 'G' ? 120 : 200;
    return of255 << (pixel.bits - 8);
  };
  std::vector<std::uint8_t> bytes(format.size_image, 0);
  for (int y = 0; y < kH; ++y)
    for (int x = 0; x < kW; ++x) {
      const int value = level(order[2 * (y % 2) + x % 2]);
      std::uint8_t* line = bytes.data() + y * format.bytes_per_line;
      if (pixel.layout == PixelLayout::bayer_packed) {
        const int group = pixel.bits == 10 ? 4 : 2, low = pixel.bits - 8;
        std::uint8_t* packed = line + x / group * (group + 1);
        packed[x % group] = static_cast<std::uint8_t>(value >> low);
        packed[group] = static_cast<std::uint8_t>(packed[group] | (value & ((1 << low) - 1))
                                                                      << (x % group * low));
      } else if (pixel.bits > 8) {
        line[2 * x] = static_cast<std::uint8_t>(value & 255);
        line[2 * x + 1] = static_cast<std::uint8_t>(value >> 8);
      } else {
        line[x] = static_cast<std::uint8_t>(value);
      }
    }
  const auto picture = PictureOf(format, Bytes(bytes));
  ASSERT_TRUE(picture) << ToString(picture.error());
  ASSERT_EQ(picture->type(), pixel.bits > 8 ? CV_16UC3 : CV_8UC3);
  cv::Mat wide;
  picture->convertTo(wide, CV_32FC3, pixel.bits > 8 ? 1.0 / 256 : 1);
  const cv::Vec3f middle = wide.at<cv::Vec3f>(kH / 2, kW / 2);
  EXPECT_NEAR(middle[0], 200, 0.5);
  EXPECT_NEAR(middle[1], 120, 0.5);
  EXPECT_NEAR(middle[2], 20, 0.5);
}

INSTANTIATE_TEST_SUITE_P(Formats, Bayer,
                         ::testing::Values("RGGB", "BA81", "GRBG", "GBRG", "RG10", "BG10", "BA10",
                                           "GB10", "pRAA", "pBAA", "pgAA", "pGAA", "RG12", "pRCC",
                                           "pGCC", "RG14", "RG16", "BYR2"),
                         [](const auto& instance) { return std::string(instance.param); });

TEST(Convert, TooFewBytesAreAnErrorForEveryPlainFormat) {
  for (const char* name : {"YUYV", "NV12", "RGB3", "GREY", "RG10", "pRAA"}) {
    const StreamFormat format = FormatNamed(name, 16, 8);
    const std::vector<std::uint8_t> bytes(format.size_image - 1);
    const auto picture = PictureOf(format, Bytes(bytes));
    ASSERT_FALSE(picture) << name;
    EXPECT_EQ(picture.error().kind, ErrorKind::device);
  }
}

}  // namespace
}  // namespace scan
