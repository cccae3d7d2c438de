#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "reconstruction/masks/make_masks.h"

namespace scan {
namespace {

TEST(RealPhotographs, SquirrelWithoutAPlateAgreesWithTheGivenMasks) {
  const std::filesystem::path folder =
      std::filesystem::path(SCAN_SOURCE_DIR) / "../shared/data/squirrel_turntable";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "shared/data/squirrel_turntable is absent";
  for (const char* name : {"image_00", "image_12", "image_24"}) {
    const cv::Mat photo = cv::imread((folder / "photos" / (std::string(name) + ".jpg")).string());
    const auto given = LoadMask(folder / "masks" / (std::string(name) + ".png"), photo.size());
    ASSERT_TRUE(given) << ToString(given.error());
    const auto mask = MakeMask(photo, {}, {});
    ASSERT_TRUE(mask) << ToString(mask.error());
    // The given masks are unreliable in the lowest 12 % of the figure.
    const cv::Mat a = mask->coverage > 127, b = given->coverage > 127;
    const double both = cv::countNonZero(a & b), either = cv::countNonZero(a | b);
    EXPECT_GT(both / either, 0.93) << name;
  }
}

}  // namespace
}  // namespace scan
