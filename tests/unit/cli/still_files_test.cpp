#include "firmware-host/cli/still_files.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/temp_folder.h"

namespace scan {
namespace {

// Two files a frame, as a still camera set to RAW and JPEG gives them.
class PairCamera final : public Camera {
 public:
  const CameraInfo& Info() const override { return info_; }
  Result<AppliedSettings> Configure(const CameraSettings& settings) override {
    asked = settings;
    return AppliedSettings{settings.exposure_us, settings.gain};
  }
  Result<Frame> Grab(std::stop_token) override {
    Frame frame;
    frame.files = {{"jpg", std::vector<std::byte>(++grabs)}, {"nef", std::vector<std::byte>(100)}};
    frame.exposure = {1, 2, ExposureSource::hot_shoe};
    frame.applied.exposure_us = asked.exposure_us;
    return frame;
  }
  CameraSettings asked;
  std::size_t grabs = 0;

 private:
  CameraInfo info_{"c0", "pair", 64, 48};
};

TEST(StillFiles, EveryFileOfEveryFrameIsWritten) {
  const TempFolder folder;
  PairCamera camera;
  StillOptions options;
  options.out = folder.path() / "still.png";
  options.count = 2;
  options.exposure_us = 8000;
  const auto output = TakeStills(camera, options, {});
  ASSERT_TRUE(output) << ToString(output.error());
  EXPECT_EQ(camera.asked.exposure_us, 8000);
  EXPECT_FALSE(camera.asked.gain);
  for (const char* name : {"still-1.nef", "still-2.nef"})
    EXPECT_EQ(std::filesystem::file_size(folder.path() / name), 100U) << name;
  EXPECT_EQ(std::filesystem::file_size(folder.path() / "still-1.jpg"), 1U);
  EXPECT_EQ(std::filesystem::file_size(folder.path() / "still-2.jpg"), 2U);
  const Json& still = output->json["stills"][1];
  EXPECT_EQ(still["paths"].size(), 2U);
  EXPECT_EQ(still["exposure_us"], 8000);
  EXPECT_FALSE(still.contains("gain"));
  EXPECT_EQ(still["hot_shoe"], true);
  EXPECT_FALSE(TakeStills(camera, options, {}));  // never overwritten unasked
  options.force = true;
  EXPECT_TRUE(TakeStills(camera, options, {}));
}

TEST(StillFiles, SizesAndAssignmentsAreReadWhole) {
  EXPECT_EQ(ReadSize("640x480").value(), std::pair(640, 480));
  for (const char* text : {"", "640", "640x", "x480", "640x480 ", "640 x480", "-640x480", "0x480",
                           "640X480", "99999999999x1", "1x99999999999"})
    EXPECT_FALSE(ReadSize(text)) << text;
  EXPECT_EQ(SplitAssignment("a=b=c").value(), std::pair(std::string("a"), std::string("b=c")));
  EXPECT_EQ(SplitAssignment("a=").value().second, "");
  for (const char* text : {"", "a", "=b"}) EXPECT_FALSE(SplitAssignment(text)) << text;
}

}  // namespace
}  // namespace scan
