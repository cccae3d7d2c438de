#include "drivers/camera/ptp/ptp_camera.h"

#include <gtest/gtest.h>

#include "tests/support/ptp_bench.h"

namespace scan {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

PtpCameraOptions With(const std::function<void(PtpConfig&)>& change) {
  PtpCameraOptions options;
  change(options.config);
  return options;
}

// The frame's bound holds the exposure that really took place, and its JPEG is that one's.
void ExpectTrue(PtpBench& bench, const Frame& frame, std::size_t exposure) {
  const SimDslr::Exposure& truth = bench.dslr->exposures().at(exposure - 1);
  EXPECT_LE(frame.exposure.not_before_ns, truth.begin_ns);
  EXPECT_GE(frame.exposure.not_after_ns, truth.end_ns);
  EXPECT_EQ(frame.files.front().bytes, SimDslrJpeg(static_cast<int>(exposure)));
}

TEST(PtpCamera, RawAndJpegOfOneExposureAreOneFrame) {
  for (const auto& [kind, quality, raw] :
       {std::tuple(DslrKind::nikon, "NEF+Fine", "nef"), {DslrKind::canon, "RAW + L", "cr2"}}) {
    PtpBench bench(kind, With([&, q = quality](PtpConfig& c) { c.quality = q; }));
    ASSERT_TRUE(bench.Open());
    for (std::size_t exposure = 1; exposure <= 3; ++exposure) {
      const auto frame = bench.camera->Grab({});
      ASSERT_TRUE(frame) << ToString(frame.error());
      ASSERT_EQ(frame->files.size(), 2U);
      EXPECT_EQ(frame->files[0].extension, "jpg");
      EXPECT_EQ(frame->files[1].extension, raw);
      EXPECT_EQ(frame->files[1].bytes.back(), static_cast<std::byte>(exposure));
      ExpectTrue(bench, *frame, exposure);
    }
    EXPECT_TRUE(bench.dslr->files().empty());  // the camera's memory is free again
  }
}

TEST(PtpCamera, FilesOfEarlierExposuresNeverCount) {
  PtpBench bench;
  ASSERT_TRUE(bench.Open());
  bench.dslr->PressButton();
  bench.clock->SleepFor(5 * kSecond);
  auto frame = bench.camera->Grab({});
  ASSERT_TRUE(frame) << ToString(frame.error());
  ExpectTrue(bench, *frame, 2);
  EXPECT_EQ(bench.camera->counters().stale, 1);
  EXPECT_TRUE(bench.dslr->files().empty());
  // One that arrives after our release, yet before our exposure can have ended.
  ASSERT_TRUE(bench.camera->Configure({.exposure_us = 1e6, .gain = {}}));
  bench.dslr->setting("shutterspeed2").value = "1/125";
  bench.dslr->PressButton();
  bench.clock->SleepFor(100'000'000);
  frame = bench.camera->Grab({});
  ASSERT_TRUE(frame) << ToString(frame.error());
  ExpectTrue(bench, *frame, 4);
  EXPECT_EQ(*frame->applied.exposure_us, 1e6);
}

TEST(PtpCamera, TheFlashContactTellsOfSomebodyElsesRelease) {
  PtpBench bench;
  ASSERT_TRUE(bench.Open(bench.dslr->Lines()));
  bench.dslr->PressButton();
  bench.clock->SleepFor(300'000'000);  // its file comes just after ours would be released
  auto frame = bench.camera->Grab({});
  ASSERT_TRUE(frame) << ToString(frame.error());
  ExpectTrue(bench, *frame, 2);
  EXPECT_EQ(bench.camera->counters().stale, 1);
}

TEST(PtpCamera, FilesOfTwoExposuresAreAFault) {
  PtpBench bench(DslrKind::nikon, With([](PtpConfig& c) { c.quality = "NEF+Fine"; }));
  ASSERT_TRUE(bench.Open());
  bench.dslr->PressButton();
  bench.clock->SleepFor(100'000'000);
  const auto mixed = bench.camera->Grab({});  // the files of both come mixed
  ASSERT_FALSE(mixed);
  EXPECT_EQ(mixed.error().kind, ErrorKind::device);
  const auto next = bench.camera->Grab({});
  ASSERT_TRUE(next) << ToString(next.error());
  ExpectTrue(bench, *next, 3);
}

TEST(PtpCamera, SettingsAreSetReadBackAndHeldAtEveryFrame) {
  PtpBench bench(DslrKind::nikon, With([](PtpConfig& c) {
                   c.f_number = 5.6;
                   c.settings = {{"imagequality", "NEF+Fine"}};
                   c.files = 2;
                 }));
  bench.dslr->setting("isoauto").value = "On";
  ASSERT_TRUE(bench.Open());
  const auto applied = bench.camera->Configure({.exposure_us = 16'700, .gain = 2});
  ASSERT_TRUE(applied) << ToString(applied.error());
  EXPECT_NEAR(*applied->exposure_us, 1e6 / 60, 1);
  EXPECT_EQ(*applied->gain, 2);
  EXPECT_EQ(bench.dslr->setting("shutterspeed2").value, "1/60");
  EXPECT_EQ(bench.dslr->setting("f-number").value, "f/5.6");
  EXPECT_EQ(bench.dslr->setting("isoauto").value, "Off");
  bench.dslr->setting("iso").value = "1600";  // a dial was turned
  bench.dslr->setting("f-number").value = "f/11";
  const auto frame = bench.camera->Grab({});
  ASSERT_TRUE(frame) << ToString(frame.error());
  EXPECT_EQ(*frame->applied.gain, 2);
  EXPECT_EQ(bench.dslr->setting("iso").value, "200");
  EXPECT_EQ(bench.dslr->setting("f-number").value, "f/5.6");
}

TEST(PtpCamera, ASettingThatTheCameraDoesNotKeepIsAFault) {
  PtpBench bench;
  ASSERT_TRUE(bench.Open());
  ASSERT_TRUE(bench.camera->Configure({.exposure_us = 8000, .gain = 1}));
  bench.dslr->stuck["shutterspeed2"] = "1/100";  // takes another value than asked for
  const auto refused = bench.camera->Configure({.exposure_us = 4000, .gain = {}});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("keeps shutterspeed2 at '1/100' instead of '1/250'"),
            std::string::npos)
      << refused.error().what;
  EXPECT_TRUE(bench.dslr->exposures().empty());
  bench.dslr->stuck.clear();
  const auto frame = bench.camera->Grab({});  // with the settings before
  ASSERT_TRUE(frame) << ToString(frame.error());
  EXPECT_EQ(*frame->applied.exposure_us, 8000);
}

TEST(PtpCamera, DialsThatAreNotOnManualAreFaults) {
  PtpBench bench;
  ASSERT_TRUE(bench.Open());
  ASSERT_TRUE(bench.camera->Configure({.exposure_us = 8000, .gain = {}}));
  bench.dslr->setting("expprogram").value = "A";
  auto frame = bench.camera->Grab({});
  ASSERT_FALSE(frame);
  EXPECT_NE(frame.error().mend.find("mode dial to M"), std::string::npos);
  bench.dslr->setting("expprogram").value = "M";
  bench.dslr->setting("focusmode").value = "AF-S";
  frame = bench.camera->Grab({});
  ASSERT_FALSE(frame);
  EXPECT_NE(frame.error().mend.find("manual focus"), std::string::npos);
  EXPECT_TRUE(bench.dslr->exposures().empty());
}

TEST(PtpCamera, ConfigurationsThatCannotBeFulfilledAreRefused) {
  for (const auto& change : std::vector<std::function<void(PtpConfig&)>>{
           [](PtpConfig& c) { c.quality = "TIFF"; }, [](PtpConfig& c) { c.f_number = 1.4; },
           [](PtpConfig& c) {
             c.settings = {{"nosuch", "1"}};
           },
           [](PtpConfig& c) {
             c.settings = {{"imagequality", "nosuch"}};
           },
           [](PtpConfig& c) { c.target = "cloud"; }}) {
    PtpBench bench(DslrKind::nikon, With(change));
    const Status opened = bench.Open();
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().kind, ErrorKind::bad_input) << ToString(opened.error());
    EXPECT_EQ(bench.dslr->open_cameras, 0);
  }
}

TEST(PtpCamera, CopiesOnTheCardAreDeletedOnlyWhenAsked) {
  for (const bool asked : {false, true}) {
    PtpBench bench(DslrKind::canon, With([&](PtpConfig& c) {
                     c.target = "card";
                     c.quality = "RAW + L";
                     c.delete_from_card = asked;
                   }));
    ASSERT_TRUE(bench.Open());
    ASSERT_TRUE(bench.camera->Configure({}));
    bench.dslr->PressButton();  // somebody's picture: never ours to delete
    bench.clock->SleepFor(5 * kSecond);
    ASSERT_TRUE(bench.camera->Grab({}));
    EXPECT_EQ(bench.dslr->files().size(), asked ? 2U : 4U);
    EXPECT_EQ(bench.dslr->files().count("/store_00010001/DCIM/100SIM/IMG_0001.JPG"), 1U);
  }
}

TEST(PtpCamera, DamagedOrMissingFilesAreFaultsAndTheNextFrameIsGood) {
  PtpBench bench(DslrKind::nikon, With([](PtpConfig& c) { c.quality = "NEF+Fine"; }));
  ASSERT_TRUE(bench.Open());
  bench.dslr->cuts_jpeg = true;
  auto frame = bench.camera->Grab({});
  ASSERT_FALSE(frame);
  EXPECT_NE(frame.error().what.find("cut off"), std::string::npos);
  bench.dslr->cuts_jpeg = false;
  bench.dslr->loses_raw = true;
  const std::int64_t asked_ns = bench.now_ns();
  frame = bench.camera->Grab({});
  ASSERT_FALSE(frame);
  EXPECT_NE(frame.error().what.find("1 of 2 files"), std::string::npos);
  EXPECT_LT(bench.now_ns() - asked_ns, 20 * kSecond);
  bench.dslr->loses_raw = false;
  frame = bench.camera->Grab({});
  ASSERT_TRUE(frame) << ToString(frame.error());
  ExpectTrue(bench, *frame, 3);
  EXPECT_TRUE(bench.dslr->files().empty());
}

TEST(PtpCamera, ABusyCameraIsWaitedFor) {
  PtpBench bench;
  ASSERT_TRUE(bench.Open());
  bench.dslr->busy_releases = 5;
  const auto frame = bench.camera->Grab({});
  ASSERT_TRUE(frame) << ToString(frame.error());
  EXPECT_EQ(bench.dslr->exposures().size(), 1U);
  bench.dslr->busy_releases = 1'000'000;
  const std::int64_t asked_ns = bench.now_ns();
  EXPECT_FALSE(bench.camera->Grab({}));
  EXPECT_LT(bench.now_ns() - asked_ns, 30 * kSecond);
}

TEST(PtpCamera, TheFlashContactTellsTheExposureMoreClosely) {
  PtpBench bench;
  ASSERT_TRUE(bench.Open(bench.dslr->Lines()));
  ASSERT_TRUE(bench.camera->Configure({.exposure_us = 10'000, .gain = {}}));
  bench.dslr->PressButton();  // an old pulse
  bench.clock->SleepFor(5 * kSecond);
  const auto frame = bench.camera->Grab({});
  ASSERT_TRUE(frame) << ToString(frame.error());
  EXPECT_EQ(frame->exposure.source, ExposureSource::hot_shoe);
  ExpectTrue(bench, *frame, 2);
  EXPECT_LE(frame->exposure.not_after_ns - frame->exposure.not_before_ns, 20'000'000);
}

TEST(PtpCamera, UnpluggedAndPluggedInAgainBetweenFrames) {
  PtpBench bench;
  ASSERT_TRUE(bench.Open());
  ASSERT_TRUE(bench.camera->Configure({.exposure_us = 4000, .gain = 2}));
  bench.dslr->Unplug(bench.now_ns() + 2 * kSecond);
  bench.dslr->setting("iso").value = "100";  // as after switching on
  const auto frame = bench.camera->Grab({});
  ASSERT_TRUE(frame) << ToString(frame.error());
  EXPECT_EQ(*frame->applied.exposure_us, 4000);
  EXPECT_EQ(*frame->applied.gain, 2);
  EXPECT_EQ(bench.camera->counters().reopened, 1);
  bench.dslr->Unplug(bench.now_ns() + 1000 * kSecond);
  const std::int64_t asked_ns = bench.now_ns();
  const auto gone = bench.camera->Grab({});
  ASSERT_FALSE(gone);
  EXPECT_EQ(gone.error().kind, ErrorKind::device);
  EXPECT_LT(bench.now_ns() - asked_ns, 10 * kSecond);
  EXPECT_EQ(bench.dslr->open_cameras, 0);
}

// Every call of opening, setting up and two frames fails once, in every way.
TEST(PtpCamera, EveryCallMayFail) {
  int calls = 0;
  for (const auto& [kind, unplugs] : {std::pair(PhotoFaultKind::transfer, false),
                                      {PhotoFaultKind::gone, true},
                                      {PhotoFaultKind::timeout, false},
                                      {PhotoFaultKind::refused, false}}) {
    for (int nth = 1;; ++nth) {
      PtpBench bench(DslrKind::nikon, With([](PtpConfig& c) { c.quality = "NEF+Fine"; }));
      bench.dslr->fail_at = nth;
      bench.dslr->fail_kind = kind;
      bench.dslr->fail_unplugs = unplugs;
      Status opened = bench.Open();
      if (!opened) {
        bench.clock->SleepFor(2 * kSecond);
        opened = bench.Open();
      }
      ASSERT_TRUE(opened) << nth << ToString(opened.error());
      auto configured = bench.camera->Configure({.exposure_us = 4000, .gain = 2});
      if (!configured) configured = bench.camera->Configure({.exposure_us = 4000, .gain = 2});
      ASSERT_TRUE(configured) << nth << ToString(configured.error());
      for (int k = 0; k < 2; ++k) {
        auto frame = bench.camera->Grab({});
        if (!frame) {
          EXPECT_FALSE(frame.error().what.empty());
          frame = bench.camera->Grab({});
        }
        ASSERT_TRUE(frame) << nth << ToString(frame.error());
        EXPECT_EQ(*frame->applied.exposure_us, 4000);
        EXPECT_EQ(frame->files.size(), 2U);
        ExpectTrue(bench, *frame, bench.dslr->exposures().size());
      }
      bench.camera.reset();
      EXPECT_EQ(bench.dslr->open_cameras, 0);
      calls = bench.dslr->calls;
      if (bench.dslr->calls < nth) break;
    }
  }
  EXPECT_GT(calls, 40);
}

TEST(PtpCamera, ACancelEndsTheWaitAndTheLateFilesNeverCount) {
  PtpBench bench;
  ASSERT_TRUE(bench.Open());
  ASSERT_TRUE(bench.camera->Configure({.exposure_us = 30e6, .gain = {}}));
  std::stop_source stop;
  bench.dslr->on_release = [&] { stop.request_stop(); };
  const auto frame = bench.camera->Grab(stop.get_token());
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().kind, ErrorKind::cancelled);
  EXPECT_EQ(bench.dslr->exposures().size(), 1U);
  const auto next = bench.camera->Grab({});
  ASSERT_TRUE(next) << ToString(next.error());
  ExpectTrue(bench, *next, bench.dslr->exposures().size());
}

}  // namespace
}  // namespace scan
