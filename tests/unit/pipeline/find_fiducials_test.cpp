#include "reconstruction/pipeline/find_fiducials.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "drivers/base/files.h"

namespace scan {
namespace {

std::filesystem::path File(const std::string& name) {
  return std::filesystem::path(::testing::TempDir()) / name;
}

const std::vector<Bead> kBeads{{{1.25, -2, 3}, 0.5, 0.01, 0.02}, {{4, 5, 6}, 0.5, 0, 0}};

TEST(FindFiducials, BeadsAreReadAsWritten) {
  const auto path = File("beads.json");
  ASSERT_TRUE(WriteBeads(path, kBeads));
  const auto read = ReadBeads(path);
  ASSERT_TRUE(read) << ToString(read.error());
  ASSERT_EQ(read->size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ((*read)[i].centre, kBeads[i].centre);
    EXPECT_EQ((*read)[i].radius_mm, kBeads[i].radius_mm);
    EXPECT_EQ((*read)[i].sigma_mm, kBeads[i].sigma_mm);
  }
}

TEST(FindFiducials, WrongFilesOfBeadsAreRefused) {
  const auto path = File("wrong-beads.json");
  EXPECT_FALSE(ReadBeads(File("absent.json")));
  for (const char* text :
       {"", "{", "[]", "{}", R"({"schema":"other/1","beads":[]})",
        R"({"schema":"scanstation.beads/1"})", R"({"schema":"scanstation.beads/1","beads":[]})",
        R"({"schema":"scanstation.beads/1","beads":[{"centre":[1,2],"radius_mm":1}]})",
        R"({"schema":"scanstation.beads/1","beads":[{"centre":[1,2,"x"],"radius_mm":1}]})",
        R"({"schema":"scanstation.beads/1","beads":[{"centre":[1,2,3],"radius_mm":0}]})"}) {
    ASSERT_TRUE(WriteFileDurably(path, std::string_view(text)));
    EXPECT_FALSE(ReadBeads(path)) << text;
  }
}

TEST(FindFiducials, NeedsBothBeadsAndTheirColour) {
  const auto path = File("beads.json");
  ASSERT_TRUE(WriteBeads(path, kBeads));
  PhotoSet photos;
  photos.photos.resize(1);
  photos.photos[0].path = File("photo.png");
  cv::Mat picture(60, 80, CV_8UC3, cv::Scalar(90, 90, 90));
  picture(cv::Rect(20, 30, 6, 6)) = cv::Scalar(255, 96, 0);
  ASSERT_TRUE(cv::imwrite(photos.photos[0].path.string(), picture));
  const Volume none;
  FiducialOptions options;
  const auto find = [&] { return FindFiducials(options, &none, photos, {}, {}); };
  options.bead_colour = Eigen::Vector3d(0, 0.12, 1);
  EXPECT_FALSE(find());  // no beads
  options.beads = path;
  const auto found = find();
  ASSERT_TRUE(found) << ToString(found.error());
  EXPECT_EQ(found->beads.size(), 2u);
  ASSERT_EQ(found->images.size(), 1u);
  ASSERT_EQ(found->images[0].size(), 1u);
  EXPECT_NEAR(found->images[0][0].centre.x(), 23, 0.05);
  EXPECT_NEAR(found->images[0][0].centre.y(), 33, 0.05);
  options.bead_mm = 1.0;
  EXPECT_FALSE(find());  // both a file and a diameter
  options.bead_mm.reset();
  options.bead_colour.reset();
  EXPECT_FALSE(find());  // no colour
  options.bead_colour = Eigen::Vector3d(0, 0.12, 1);
  photos.photos[0].path = File("absent.png");
  EXPECT_FALSE(find());
}

}  // namespace
}  // namespace scan
