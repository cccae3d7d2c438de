#include "drivers/camera/v4l2/v4l2_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/camera/jpeg_decode.h"
#include "tests/support/v4l2_bench.h"

namespace scan {
namespace {

CameraSettings Exposure(double us) {
  CameraSettings settings;
  settings.exposure_us = us;
  return settings;
}

struct TimingCase {
  const char* name;
  int held_frames, latency_frames;
  std::uint32_t stamp_flags;
  std::int64_t stamp_ahead_ns = 0;
};

class V4l2Timing : public ::testing::TestWithParam<TimingCase> {};

TEST_P(V4l2Timing, TheTrueExposureBeginsAfterTheCallAndWithinTheBound) {
  SimulatedV4l2Options simulated;
  simulated.held_frames = GetParam().held_frames;
  simulated.stamp_flags = GetParam().stamp_flags;
  simulated.stamp_ahead_ns = GetParam().stamp_ahead_ns;
  V4l2CameraOptions options;
  options.config.latency_frames = GetParam().latency_frames;
  V4l2Bench bench(simulated, options);
  ASSERT_TRUE(bench.Open());
  for (const std::int64_t idle_ns : {0L, 1'000'000L, 17'000'000L, 3'000'000'000L}) {
    bench.clock->SleepFor(idle_ns);
    const std::int64_t called_ns = bench.now_ns();
    const auto frame = bench.camera->Grab({});
    ASSERT_TRUE(frame) << ToString(frame.error());
    const auto& truth = bench.system->truth(frame->sensor_sequence);
    EXPECT_GE(truth.exposure_start_ns, called_ns);
    EXPECT_LE(frame->exposure.not_before_ns, truth.exposure_start_ns);
    const auto exposure_ns = static_cast<std::int64_t>(truth.exposure_us * 1e3);
    EXPECT_GE(frame->exposure.not_after_ns, truth.exposure_start_ns + exposure_ns);
  }
  EXPECT_GT(bench.camera->counters().stale, 0);
  EXPECT_EQ(bench.camera->counters().restarts, 0);
}

constexpr std::uint32_t kMono = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
INSTANTIATE_TEST_SUITE_P(
    Cameras, V4l2Timing,
    ::testing::Values(TimingCase{"uvc", 1, 1, kMono | V4L2_BUF_FLAG_TSTAMP_SRC_SOE},
                      TimingCase{"prompt", 0, 0, kMono | V4L2_BUF_FLAG_TSTAMP_SRC_SOE},
                      TimingCase{"end_of_frame", 1, 1, kMono},
                      TimingCase{"stamped_ahead", 1, 1, kMono, 6'000'000},
                      TimingCase{"slow", 3, 3, kMono | V4L2_BUF_FLAG_TSTAMP_SRC_SOE},
                      TimingCase{"unstamped", 1, 1, 0}),
    [](const auto& instance) { return std::string(instance.param.name); });

TEST(V4l2Camera, AnExposureAskedForIsTheOneOfTheFrame) {
  V4l2Bench bench;
  ASSERT_TRUE(bench.Open());
  for (const double us : {4000.0, 60'000.0, 4000.0, 120'000.0, 300.0}) {
    const auto applied = bench.camera->Configure(Exposure(us));
    ASSERT_TRUE(applied) << ToString(applied.error());
    EXPECT_EQ(applied->exposure_us, us);
    const auto frame = bench.camera->Grab({});
    ASSERT_TRUE(frame) << ToString(frame.error());
    EXPECT_EQ(frame->applied.exposure_us, us);
    EXPECT_EQ(bench.system->truth(frame->sensor_sequence).exposure_us, us);
  }
  EXPECT_GT(bench.camera->counters().unsettled, 0);
}

TEST(V4l2Camera, AnExposureBetweenTwoStepsIsRefusedWithBoth) {
  V4l2Bench bench;
  ASSERT_TRUE(bench.Open());
  const auto applied = bench.camera->Configure(Exposure(450));
  ASSERT_FALSE(applied);
  EXPECT_EQ(applied.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(applied.error().mend, testing::HasSubstr("400 or 500"));
}

TEST(V4l2Camera, GainIsAFactorWhereItsUnitIsKnownAndElseUnreported) {
  CameraSettings settings;
  settings.gain = 4;
  V4l2Bench without;
  ASSERT_TRUE(without.Open());
  const auto unknown = without.camera->Configure(settings);
  ASSERT_TRUE(unknown);
  EXPECT_EQ(unknown->gain, std::nullopt);
  V4l2CameraOptions options;
  options.config.unity_gain = 16;
  V4l2Bench with({}, options);
  ASSERT_TRUE(with.Open());
  const auto known = with.camera->Configure(settings);
  ASSERT_TRUE(known) << ToString(known.error());
  EXPECT_EQ(known->gain, 4);
  EXPECT_EQ(with.system->control(V4L2_CID_GAIN).value, 64);
  settings.gain = 17;
  EXPECT_FALSE(with.camera->Configure(settings));
}

TEST(V4l2Camera, AutomaticsAreOffAndTheConfiguredControlsSet) {
  V4l2CameraOptions options;
  options.config.controls = {{"brightness", "-12"},
                             {"focus_absolute", "120"},
                             {"power_line_frequency", "60 Hz"},
                             {"white_balance_temperature", "5200"}};
  V4l2Bench bench({}, options);
  ASSERT_TRUE(bench.Open());
  const auto value = [&](std::uint32_t id) { return bench.system->control(id).value; };
  EXPECT_EQ(value(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(value(V4L2_CID_AUTO_WHITE_BALANCE), 0);
  EXPECT_EQ(value(V4L2_CID_FOCUS_AUTO), 0);
  EXPECT_EQ(value(V4L2_CID_BRIGHTNESS), -12);
  EXPECT_EQ(value(V4L2_CID_FOCUS_ABSOLUTE), 120);
  EXPECT_EQ(value(V4L2_CID_POWER_LINE_FREQUENCY), 2);
  EXPECT_EQ(value(V4L2_CID_WHITE_BALANCE_TEMPERATURE), 5200);
}

TEST(V4l2Camera, AutomaticsAreLeftAloneWhenAsked) {
  V4l2CameraOptions options;
  options.config.lock_automatics = false;
  V4l2Bench bench({}, options);
  ASSERT_TRUE(bench.Open());
  EXPECT_EQ(bench.system->control(V4L2_CID_AUTO_WHITE_BALANCE).value, 1);
}

TEST(V4l2Camera, AConfigurationThatTheCameraCannotFulfilIsBadInput) {
  const std::pair<const char*, const char*> controls[] = {{"sharpness", "3"},
                                                          {"brightness", "900"},
                                                          {"contrast", "57"},
                                                          {"auto_exposure", "moonlight"}};
  for (const auto& [name, text] : controls) {
    V4l2CameraOptions options;
    options.config.controls = {{name, text}};
    V4l2Bench bench({}, options);
    const Status opened = bench.Open();
    ASSERT_FALSE(opened) << name;
    EXPECT_EQ(opened.error().kind, ErrorKind::bad_input) << ToString(opened.error());
    bench.ExpectNothingHeld();
  }
}

TEST(V4l2Camera, AControlChangedByAnotherProgramIsReportedWithAFrameTakenAfter) {
  V4l2Bench bench;
  ASSERT_TRUE(bench.Open());
  ASSERT_TRUE(bench.camera->Configure(Exposure(8000)));
  ASSERT_TRUE(bench.camera->Grab({}));
  bench.system->control(V4L2_CID_EXPOSURE_ABSOLUTE).value = 40;
  const auto frame = bench.camera->Grab({});
  ASSERT_TRUE(frame) << ToString(frame.error());
  EXPECT_EQ(frame->applied.exposure_us, 4000);
  EXPECT_EQ(bench.system->truth(frame->sensor_sequence).exposure_us, 4000);
}

TEST(V4l2Camera, MjpegIsKeptAsItWasSentAndPlainFormatsWithoutLoss) {
  for (const bool tables : {true, false}) {
    SimulatedV4l2Options simulated;
    simulated.huffman_tables = tables;
    V4l2CameraOptions options;
    options.config.pixel_format = "MJPG";
    V4l2Bench bench(simulated, options);
    ASSERT_TRUE(bench.Open());
    EXPECT_EQ(bench.camera->Info().w, 128);
    const auto frame = bench.camera->Grab({});
    ASSERT_TRUE(frame) << ToString(frame.error());
    EXPECT_EQ(frame->files.front().extension, "jpg");
    EXPECT_TRUE(DecodeJpegStrictly(frame->files.front().bytes));
  }
  V4l2CameraOptions options;
  options.config.pixel_format = "YUYV";
  V4l2Bench bench({}, options);
  ASSERT_TRUE(bench.Open());
  const auto frame = bench.camera->Grab({});
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->files.front().extension, "png");
}

TEST(V4l2Camera, SelectionIsByPortOrNameNeverByNumber) {
  struct Case {
    const char *port, *name;
    bool fits;
  };
  for (const Case& c : {Case{"sim-hcd.0/1.2", "", true},
                        {"", "Sim Cam", true},
                        {"", "", true},
                        {"sim-hcd.0/1.3", "", false},
                        {"sim-hcd.0/1.2", "Other", false},
                        {"/dev/video0", "", false}}) {
    V4l2CameraOptions options;
    options.config.port = c.port;
    options.config.name = c.name;
    V4l2Bench bench({}, options);
    const Status opened = bench.Open();
    EXPECT_EQ(opened.has_value(), c.fits) << c.port << " " << c.name;
    if (!opened) {
      EXPECT_THAT(opened.error().what, testing::HasSubstr("'Sim Cam' at sim-hcd.0/1.2"));
    }
  }
}

TEST(V4l2Camera, AThousandCyclesHoldNothing) {
  V4l2Bench bench;
  for (int cycle = 0; cycle < 1000; ++cycle) {
    ASSERT_TRUE(bench.Open());
    if (cycle % 10 == 0) {
      ASSERT_TRUE(bench.camera->Grab({}));
    }
    bench.camera.reset();
    ASSERT_EQ(bench.system->open_descriptors(), 0) << cycle;
    ASSERT_EQ(bench.system->live_mappings() + bench.system->live_buffers(), 0) << cycle;
  }
}

TEST(V4l2Stream, AnExportedBufferIsADescriptorOfItsOwn) {
  V4l2Bench bench;
  ASSERT_TRUE(bench.Open());
  {
    const auto exported = bench.camera->stream()->ExportDmaBuffer(0);
    ASSERT_TRUE(exported) << ToString(exported.error());
    EXPECT_EQ(bench.system->open_descriptors(), 2);
  }
  EXPECT_EQ(bench.system->open_descriptors(), 1);
}

TEST(V4l2Stream, AContinuousReaderLosesNothing) {
  V4l2Bench bench;
  ASSERT_TRUE(bench.Open());
  std::optional<std::uint32_t> last;
  for (int i = 0; i < 300; ++i) {
    const auto frame = bench.camera->stream()->Next(*bench.clock, bench.now_ns() + kSecondNs, {});
    ASSERT_TRUE(frame) << ToString(frame.error());
    if (last) {
      ASSERT_EQ(frame->sequence, *last + 1);
    }
    EXPECT_EQ(frame->bytes().data(), bench.camera->stream()->Memory(frame->buffer).data());
    last = frame->sequence;
  }
}

}  // namespace
}  // namespace scan
