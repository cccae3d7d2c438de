#include <cmath>

#include "drivers/camera/decode_picture.h"
#include "tests/contract/twin.h"

namespace scan {
namespace {

TEST_P(CameraContract, AFrameIsAPictureOfTheSizeTheCameraStates) {
  const auto frame = device().Grab({});
  ASSERT_TRUE(frame) << ToString(frame.error());
  ASSERT_FALSE(frame->files.empty());
  const EncodedFile& file = frame->files.front();
  ASSERT_TRUE(file.extension == "jpg" || file.extension == "png" || file.extension == "tif");
  const auto picture = DecodePicture(file.extension, file.bytes);
  ASSERT_TRUE(picture) << ToString(picture.error());
  EXPECT_EQ(picture->cols, device().Info().w);
  EXPECT_EQ(picture->rows, device().Info().h);
}

TEST_P(CameraContract, EveryExposureBeginsAfterItsCall) {
  std::optional<std::uint64_t> previous;
  for (int k = 0; k < 5; ++k) {
    const std::int64_t called_ns = clock().Now().mono_ns;
    const auto frame = device().Grab({});
    ASSERT_TRUE(frame) << ToString(frame.error());
    EXPECT_GE(frame->exposure.not_before_ns, called_ns);
    EXPECT_GE(frame->exposure.not_after_ns, frame->exposure.not_before_ns);
    EXPECT_LE(frame->exposure.not_after_ns, clock().Now().mono_ns);
    if (previous) {
      EXPECT_GT(frame->sensor_sequence, *previous);
    }
    previous = frame->sensor_sequence;
  }
}

TEST_P(CameraContract, SettingsThatWereAskedComeWithTheFrame) {
  for (const double exposure_us : {4000.0, 10'000.0}) {
    CameraSettings settings;
    settings.exposure_us = exposure_us;
    const auto configured = device().Configure(settings);
    ASSERT_TRUE(configured) << ToString(configured.error());
    const auto frame = device().Grab({});
    ASSERT_TRUE(frame);
    if (!frame->applied.exposure_us) continue;  // the device cannot tell
    EXPECT_NEAR(*frame->applied.exposure_us, exposure_us, 0.01 * exposure_us);
    EXPECT_GE(static_cast<double>(frame->exposure.not_after_ns - frame->exposure.not_before_ns),
              0.99e3 * exposure_us);
  }
}

TEST_P(CameraContract, SettingsOutOfRangeAreRefusedAndChangeNothing) {
  const auto before = device().Configure({});
  ASSERT_TRUE(before);
  for (const double exposure_us : {-1.0, 0.0, 1e12, std::nan("")}) {
    CameraSettings settings;
    settings.exposure_us = exposure_us;
    EXPECT_FALSE(device().Configure(settings)) << exposure_us;
  }
  const auto after = device().Configure({});
  ASSERT_TRUE(after);
  EXPECT_EQ(*after, *before);
}

TEST_P(CameraContract, ARequestedTokenGivesNoFrame) {
  std::stop_source stop;
  stop.request_stop();
  const auto frame = device().Grab(stop.get_token());
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().kind, ErrorKind::cancelled);
  EXPECT_TRUE(device().Grab({}));
}

}  // namespace
}  // namespace scan
