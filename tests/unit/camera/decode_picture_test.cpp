#include "drivers/camera/decode_picture.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "drivers/base/rng.h"
#include "drivers/camera/encode_picture.h"

namespace scan {
namespace {

cv::Mat Noise(int type) {
  Rng rng(4);
  cv::Mat picture(41, 67, type);
  for (auto* p = picture.data; p < picture.dataend; ++p)
    *p = static_cast<std::uint8_t>(rng.Below(256));
  return picture;
}

std::vector<std::byte> ByOpenCv(const std::string& extension, const cv::Mat& picture) {
  std::vector<std::uint8_t> encoded;
  EXPECT_TRUE(cv::imencode("." + extension, picture, encoded));
  const auto view = std::as_bytes(std::span(encoded));
  return {view.begin(), view.end()};
}

cv::Mat ByOpenCv(const std::vector<std::byte>& bytes) {
  return cv::imdecode(
      cv::Mat(1, static_cast<int>(bytes.size()), CV_8U, const_cast<std::byte*>(bytes.data())),
      cv::IMREAD_UNCHANGED);
}

TEST(DecodePicture, PngAndTiffOfOpenCvComeBackAsTheyAre) {
  for (const char* extension : {"png", "tif"}) {
    const cv::Mat colour = Noise(CV_8UC3), grey = Noise(CV_8UC1);
    const auto picture = DecodePicture(extension, ByOpenCv(extension, colour));
    ASSERT_TRUE(picture) << ToString(picture.error());
    EXPECT_EQ(cv::norm(*picture, colour, cv::NORM_INF), 0) << extension;
    const auto back = DecodePicture(extension, ByOpenCv(extension, grey));
    ASSERT_TRUE(back) << ToString(back.error());
    cv::Mat three;
    cv::cvtColor(grey, three, cv::COLOR_GRAY2BGR);
    EXPECT_EQ(cv::norm(*back, three, cv::NORM_INF), 0) << extension;
  }
}

TEST(DecodePicture, SixteenBitsBecomeEight) {
  const cv::Mat deep = Noise(CV_16UC3);
  cv::Mat eight;
  deep.convertTo(eight, CV_8U, 1.0 / 257);
  for (const char* extension : {"png", "tif"}) {
    const auto picture = DecodePicture(extension, ByOpenCv(extension, deep));
    ASSERT_TRUE(picture) << ToString(picture.error());
    EXPECT_LE(cv::norm(*picture, eight, cv::NORM_INF), 1) << extension;
  }
}

// Makes an entry of the first directory another (TIFF 6.0, section 2).
void ReplaceTiffTag(std::vector<std::byte>& tiff, unsigned tag, unsigned by, unsigned value) {
  const auto at = [&](std::size_t i) { return std::to_integer<std::size_t>(tiff.at(i)); };
  const auto put = [&](std::size_t i, unsigned number) {
    tiff.at(i) = static_cast<std::byte>(number & 0xff);
    tiff.at(i + 1) = static_cast<std::byte>(number >> 8);
  };
  const std::size_t directory = at(4) | at(5) << 8 | at(6) << 16 | at(7) << 24;
  const std::size_t entries = at(directory) | at(directory + 1) << 8;
  for (std::size_t entry = directory + 2; entry < directory + 2 + 12 * entries; entry += 12) {
    if ((at(entry) | at(entry + 1) << 8) != tag) continue;
    put(entry, by);
    put(entry + 8, value);
    return;
  }
  ADD_FAILURE() << "no tag " << tag;
}

TEST(DecodePicture, TheOrientationThatATiffStatesTurnsNothing) {
  constexpr unsigned kPlanarConfiguration = 284, kOrientation = 274, kBottomRight = 3;
  const cv::Mat colour = Noise(CV_8UC3);
  auto tiff = ByOpenCv("tif", colour);
  ReplaceTiffTag(tiff, kPlanarConfiguration, kOrientation, kBottomRight);
  const auto picture = DecodePicture("tif", tiff);
  ASSERT_TRUE(picture) << ToString(picture.error());
  EXPECT_EQ(cv::norm(*picture, colour, cv::NORM_INF), 0);
}

TEST(DecodePicture, AnAbsurdSizeIsAnError) {
  constexpr unsigned kWidth = 256;
  for (const unsigned claimed : {0U, 32769U, 65535U}) {
    auto tiff = ByOpenCv("tif", Noise(CV_8UC3));
    ReplaceTiffTag(tiff, kWidth, kWidth, claimed);
    EXPECT_FALSE(DecodePicture("tif", tiff)) << claimed;
  }
}

TEST(EncodePicture, PngIsWithoutLossInEightAndSixteenBits) {
  for (const int type : {CV_8UC3, CV_16UC3}) {
    const cv::Mat whole = Noise(type);
    const cv::Mat part = whole(cv::Rect(3, 2, 50, 30));  // rows with a gap between them
    const auto file = EncodePicture(part, "png", 0);
    ASSERT_TRUE(file) << ToString(file.error());
    const cv::Mat back = ByOpenCv(file->bytes);
    ASSERT_EQ(back.type(), type);
    EXPECT_EQ(cv::norm(back, part, cv::NORM_INF), 0);
  }
}

TEST(DecodePicture, CutAndSpoiledFilesAreErrorsAndNeverCrash) {
  Rng rng(8);
  for (const char* extension : {"png", "tif"}) {
    const auto whole = ByOpenCv(extension, Noise(CV_8UC3));
    for (std::size_t size = 0; size + 40 < whole.size(); size += 1 + size / 40)
      EXPECT_FALSE(DecodePicture(extension, std::span(whole).first(size)))
          << extension << " cut at " << size;
    for (int k = 0; k < 300; ++k) {
      auto spoiled = whole;
      for (int n = 0; n < 3; ++n)
        spoiled[rng.Below(std::min<std::size_t>(spoiled.size(), 400))] =
            static_cast<std::byte>(rng.Below(256));
      if (const auto picture = DecodePicture(extension, spoiled)) {
        EXPECT_FALSE(picture->empty());
      }
    }
  }
  EXPECT_FALSE(DecodePicture("gif", {}));
}

}  // namespace
}  // namespace scan
