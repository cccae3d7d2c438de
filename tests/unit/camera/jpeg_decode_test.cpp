#include "drivers/camera/jpeg_decode.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "drivers/base/rng.h"
#include "drivers/camera/encode_picture.h"

namespace scan {
namespace {

cv::Mat Gradient() {
  cv::Mat picture(48, 64, CV_8UC3);
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x)
      picture.at<cv::Vec3b>(y, x) = {static_cast<std::uint8_t>(4 * x),
                                     static_cast<std::uint8_t>(5 * y),
                                     static_cast<std::uint8_t>(x * y / 13)};
  return picture;
}

std::vector<std::byte> Jpeg() { return EncodePicture(Gradient(), "jpg", 95)->bytes; }

bool IsHuffmanSegment(const std::vector<std::byte>& b, std::size_t at) {
  return b[at] == std::byte{0xff} && b[at + 1] == std::byte{0xc4};
}

TEST(JpegDecode, AWholePictureIsDecoded) {
  const auto picture = DecodeJpegStrictly(Jpeg());
  ASSERT_TRUE(picture) << ToString(picture.error());
  EXPECT_LE(cv::norm(*picture, Gradient(), cv::NORM_INF), 12);
}

TEST(JpegDecode, EveryCutIsFound) {
  const auto whole = Jpeg();
  for (std::size_t size = 0; size + 2 < whole.size(); ++size) {
    const auto cut = DecodeJpegStrictly(std::span(whole).first(size));
    ASSERT_FALSE(cut) << size << " of " << whole.size();
    EXPECT_EQ(cut.error().kind, ErrorKind::device);
    EXPECT_FALSE(cut.error().mend.empty());
  }
}

TEST(JpegDecode, SpoiledBytesNeverCrashAndGiveAPictureOrAnError) {
  Rng rng(7);
  int found = 0;
  for (int round = 0; round < 400; ++round) {
    auto bytes = Jpeg();
    for (int k = 0; k < 8; ++k)
      bytes[rng.Next() % bytes.size()] = static_cast<std::byte>(rng.Next());
    const auto picture = DecodeJpegStrictly(bytes);
    found += picture ? 0 : 1;
    if (picture) {
      EXPECT_GT(picture->total(), 0U);
    }
  }
  EXPECT_GT(found, 200);
}

TEST(JpegDecode, TheFileIsWhatTheCameraSentWithoutItsPadding) {
  auto padded = Jpeg();
  padded.resize(padded.size() + 500, std::byte{0});
  const auto file = JpegFileOf(padded, 64, 48);
  ASSERT_TRUE(file) << ToString(file.error());
  EXPECT_EQ(file->extension, "jpg");
  EXPECT_EQ(file->bytes, Jpeg());
}

TEST(JpegDecode, MissingHuffmanTablesAreThePlainOnes) {
  auto bytes = Jpeg();
  std::size_t removed = 0;
  for (std::size_t at = 2; at + 4 < bytes.size() && bytes[at + 1] != std::byte{0xda};) {
    const std::size_t length = 2 + (std::to_integer<std::size_t>(bytes[at + 2]) << 8) +
                               std::to_integer<std::size_t>(bytes[at + 3]);
    const bool huffman = IsHuffmanSegment(bytes, at);
    const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    if (huffman) bytes.erase(from, from + static_cast<std::ptrdiff_t>(length));
    removed += huffman ? length : 0;
    at += huffman ? 0 : length;
  }
  ASSERT_GT(removed, 400U);
  const auto file = JpegFileOf(bytes, 64, 48);
  ASSERT_TRUE(file) << ToString(file.error());
  EXPECT_EQ(file->bytes.size(), Jpeg().size());
  EXPECT_TRUE(IsHuffmanSegment(file->bytes, 2));
  const auto again = DecodeJpegStrictly(file->bytes);
  ASSERT_TRUE(again);
  EXPECT_EQ(cv::norm(*again, *DecodeJpegStrictly(Jpeg()), cv::NORM_INF), 0);
}

TEST(JpegDecode, AnotherSizeThanTheStreamsIsAnError) {
  const auto file = JpegFileOf(Jpeg(), 64, 32);
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().what.find("64 x 48"), std::string::npos);
}

}  // namespace
}  // namespace scan
