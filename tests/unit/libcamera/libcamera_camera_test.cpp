// The libcamera driver on its simulated twin: what counts as a frame, and every fault.
#include "drivers/camera/libcamera/libcamera_camera.h"

#include <gtest/gtest.h>

#include "drivers/base/virtual_clock.h"
#include "tests/support/simulated_libcamera.h"

namespace scan {
namespace {

struct Bench {
  explicit Bench(SimulatedLibcameraOptions simulated = {}, LibcameraConfig config = {})
      : clock(std::make_shared<VirtualClock>()),
        system(std::make_shared<SimulatedLibcamera>(simulated, clock)) {
    options.config = std::move(config);
    if (options.config.camera.empty()) options.config.camera = "simsensor";
  }
  Status Open() {
    SCAN_TRY(camera, LibcameraCamera::Open(options, system, clock));
    return {};
  }
  // Sets an exposure and takes two frames.
  Result<Frame> Use() {
    if (!camera) SCAN_CHECK(Open());
    SCAN_CHECK(camera->Configure({.exposure_us = 4000, .gain = 2}));
    SCAN_CHECK(camera->Grab({}));
    return camera->Grab({});
  }
  std::shared_ptr<VirtualClock> clock;
  std::shared_ptr<SimulatedLibcamera> system;
  LibcameraOptions options;
  std::unique_ptr<LibcameraCamera> camera;
};

TEST(LibcameraCamera, AFrameHasTheSettingsThatItsMetadataReport) {
  for (const int delay : {0, 1, 3, 7}) {
    SimulatedLibcameraOptions simulated;
    simulated.delay_frames = delay;
    Bench bench(simulated);
    ASSERT_TRUE(bench.Open());
    for (const double exposure_us : {3000.0, 9000.0, 3000.0}) {
      ASSERT_TRUE(bench.camera->Configure({.exposure_us = exposure_us, .gain = {}}));
      const auto frame = bench.camera->Grab({});
      ASSERT_TRUE(frame) << ToString(frame.error());
      EXPECT_EQ(frame->applied.exposure_us, exposure_us) << delay;
      EXPECT_EQ(frame->exposure.source, ExposureSource::sensor);
    }
  }
}

TEST(LibcameraCamera, WhatIsNotReportedIsNotAssumed) {
  SimulatedLibcameraOptions simulated;
  simulated.reports_settings = simulated.reports_stamp = false;
  Bench bench(simulated);
  const auto frame = bench.Use();
  ASSERT_TRUE(frame) << ToString(frame.error());
  EXPECT_EQ(frame->applied, AppliedSettings{});
  EXPECT_EQ(frame->exposure.source, ExposureSource::ptp_bound);
  EXPECT_GE(bench.camera->counters().unsettled, 2);
}

TEST(LibcameraCamera, TheExposureBoundHoldsForStampsThatAreLate) {
  for (const int held : {0, 1}) {
    SimulatedLibcameraOptions simulated;
    simulated.held_frames = held;
    simulated.reports_settings = false;
    Bench bench(simulated);
    const std::int64_t origin_ns = bench.clock->Now().mono_ns;
    ASSERT_TRUE(bench.Open());
    for (int k = 0; k < 5; ++k) {
      const std::int64_t asked_ns = bench.clock->Now().mono_ns;
      const auto frame = bench.camera->Grab({});
      ASSERT_TRUE(frame) << ToString(frame.error());
      // The frame with this sequence number truly began here.
      const auto begin_ns =
          origin_ns + static_cast<std::int64_t>(frame->sensor_sequence) * 20'000'000;
      EXPECT_GE(begin_ns, asked_ns);
      EXPECT_LE(frame->exposure.not_before_ns, begin_ns);
    }
  }
}

TEST(LibcameraCamera, TakesTheLargestSizeOfAFormatThatItUnderstandsOrTheOneAsked) {
  Bench largest;
  ASSERT_TRUE(largest.Open());
  EXPECT_EQ(largest.camera->Info().w, 96);
  Bench asked;
  asked.options.w = 64;
  asked.options.h = 48;
  ASSERT_TRUE(asked.Open());
  EXPECT_EQ(asked.camera->Info().h, 48);
  Bench absent;
  absent.options.w = 65;
  absent.options.h = 48;
  const Status opened = absent.Open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().kind, ErrorKind::bad_input);
  SimulatedLibcameraOptions no_stills;
  no_stills.stills = false;
  EXPECT_TRUE(Bench(no_stills).Open());
  EXPECT_FALSE(Bench({}, {.camera = {}, .role = "video"}).Open());
  EXPECT_FALSE(Bench({}, {.camera = {}, .pixel_format = "XVUY8888"}).Open());
}

TEST(LibcameraCamera, IsFoundByIdOrModelAndNeverGuessed) {
  EXPECT_TRUE(Bench({}, {.camera = "/base/soc/sim@10"}).Open());
  const std::vector<LibcameraEntry> two = {{"a", "same"}, {"b", "same"}};
  EXPECT_EQ(FindLibcamera(two, "b")->id, "b");
  EXPECT_EQ(FindLibcamera(two, "same").error().kind, ErrorKind::bad_input);
  EXPECT_EQ(FindLibcamera(two, "").error().kind, ErrorKind::bad_input);
  EXPECT_EQ(FindLibcamera(two, "c").error().kind, ErrorKind::device);
}

TEST(LibcameraCamera, ARemovalAtEveryCallIsAFaultAndTheNextUseBeginsAnew) {
  int last_call = 0;
  {
    Bench whole;
    ASSERT_TRUE(whole.Use());
    last_call = whole.system->state->calls;
  }
  ASSERT_GT(last_call, 10);
  for (int call = 1; call <= last_call; ++call) {
    SCOPED_TRACE(call);
    SimulatedLibcameraOptions simulated;
    simulated.fails_at = call;
    Bench bench(simulated, {.camera = "simsensor", .reconnect_ms = 0});
    if (const auto first = bench.Use(); !first) {
      EXPECT_EQ(first.error().kind, ErrorKind::device);
    }
    const auto second = bench.Use();
    EXPECT_TRUE(second) << ToString(second.error());
    if (second) {
      EXPECT_EQ(second->applied.exposure_us, 4000);
    }
    bench.camera.reset();
    EXPECT_EQ(bench.system->state->open, 0);
  }
}

TEST(LibcameraCamera, SilenceDamageAndCancelledRequestsAreClearFaults) {
  SimulatedLibcameraOptions silent, damaged, cancelled, few;
  silent.silent_from = 6;
  damaged.damaged_from = 0;
  cancelled.cancelled_at = 6;
  few.damaged_from = 0;
  few.damaged_until = 8;
  for (const auto& [options, word] :
       {std::pair{silent, "sent no frame"}, {damaged, "damaged"}, {cancelled, "cancelled"}}) {
    Bench bench(options);
    ASSERT_TRUE(bench.Open());
    Result<Frame> frame = bench.Use();
    for (int k = 0; k < 10 && frame; ++k) frame = bench.camera->Grab({});
    ASSERT_FALSE(frame) << word;
    EXPECT_EQ(frame.error().kind, ErrorKind::device);
    EXPECT_NE(frame.error().what.find(word), std::string::npos) << frame.error().what;
    EXPECT_EQ(bench.system->state->open, 0);
  }
  Bench bench(few);
  EXPECT_TRUE(bench.Use());
}

TEST(LibcameraCamera, SettingsThatTheCameraNeverReachesAreAFault) {
  SimulatedLibcameraOptions simulated;
  simulated.delay_frames = 1000;
  Bench bench(simulated);
  const auto frame = bench.Use();
  ASSERT_FALSE(frame);
  EXPECT_NE(frame.error().what.find("5000 us"), std::string::npos) << frame.error().what;
}

}  // namespace
}  // namespace scan
