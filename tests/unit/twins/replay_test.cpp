#include "acquisition/twins/replay.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "acquisition/twins/compare_sessions.h"
#include "acquisition/twins/replay_devices.h"
#include "tests/support/failing_station.h"
#include "tests/support/sim_capture.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

const SimCaptureOptions kSmall{.w = 48, .h = 32, .views_a_ring = 2, .late_frames = 1};

class Watcher final : public CaptureObserver {
 public:
  explicit Watcher(std::function<void(const CaptureProgress&)> on_progress)
      : on_progress_(std::move(on_progress)) {}
  void OnProgress(const CaptureProgress& progress) override { on_progress_(progress); }

 private:
  std::function<void(const CaptureProgress&)> on_progress_;
};

// record(replay(recording)) == recording
void ExpectReplaysToItself(const fs::path& recording, const fs::path& copy) {
  const auto reports = ReplaySession(recording, copy);
  ASSERT_TRUE(Ok(reports));
  EXPECT_TRUE(Ok(CompareSessions(recording, copy)));
}

// The recorded session is written by `SCAN_RECORD=1 unit_twins`; otherwise it is replayed.
TEST(Replay, TheRecordedSessionIsReproducedByteForByte) {
  const fs::path recording = fs::path(SCAN_SOURCE_DIR) / "tests/replay/session";
  if (std::getenv("SCAN_RECORD")) {
    fs::remove_all(recording);
    SimCapture sim({.w = 160, .h = 106, .views_a_ring = 6, .late_frames = 1, .format = "jpg"});
    CaptureControl control;
    const auto report = RunCapture(sim.station, sim.Request(recording), control);
    ASSERT_TRUE(Ok(report));
    ASSERT_EQ(report->frames_rejected, 1u);
  }
  TempFolder temp;
  const auto reports = ReplaySession(recording, temp.path() / "copy");
  ASSERT_TRUE(Ok(reports));
  ASSERT_EQ(reports->size(), 1u);
  EXPECT_EQ(reports->front().outcome, CaptureOutcome::complete);
  EXPECT_EQ(reports->front().frames_rejected, 1u);
  EXPECT_EQ(reports->front().views_accepted, 12u);
  EXPECT_TRUE(Ok(CompareSessions(recording, temp.path() / "copy")));
}

TEST(Replay, RecordOfReplayOfRecordIsTheRecord) {
  TempFolder temp;
  SimCapture sim(kSmall);
  CaptureControl control;
  ASSERT_TRUE(Ok(RunCapture(sim.station, sim.Request(temp.path() / "a"), control)));
  ExpectReplaysToItself(temp.path() / "a", temp.path() / "b");
  ExpectReplaysToItself(temp.path() / "b", temp.path() / "c");
  // Recording the same simulation again gives the same bytes, too.
  SimCapture again(kSmall);
  ASSERT_TRUE(Ok(RunCapture(again.station, again.Request(temp.path() / "d"), control)));
  EXPECT_TRUE(Ok(CompareSessions(temp.path() / "a", temp.path() / "d")));
}

TEST(Replay, EveryRecordedFaultHappensAgain) {
  // One failed call, and a station that dies, at every fifth device call.
  for (const int fail_count : {1, 1 << 20}) {
    for (int at = 1; at < 30; at += 5) {
      TempFolder temp;
      SimCapture sim(kSmall);
      auto plan = std::make_shared<CallPlan>();
      plan->fail_at = at;
      plan->fail_count = fail_count;
      Station station = MakeFailing(std::move(sim.station), plan);
      CaptureControl control;
      ASSERT_TRUE(Ok(RunCapture(station, sim.Request(temp.path() / "a"), control)));
      SCOPED_TRACE(at);
      ExpectReplaysToItself(temp.path() / "a", temp.path() / "b");
    }
  }
}

TEST(Replay, PauseCancelAndResumeHappenAgain) {
  for (int cancel_at = 2; cancel_at < 24; cancel_at += 5) {
    TempFolder temp;
    {
      SimCapture sim(kSmall);
      auto plan = std::make_shared<CallPlan>();
      CaptureControl control;
      plan->before_call = [&](int call) {
        if (call == cancel_at - 1) control.Pause();
        if (call == cancel_at) control.Cancel();
      };
      Watcher watcher([&](const CaptureProgress& p) {
        if (p.state == CaptureState::paused) control.Resume();
      });
      Station station = MakeFailing(std::move(sim.station), plan);
      ASSERT_TRUE(Ok(RunCapture(station, sim.Request(temp.path() / "a"), control, &watcher)));
    }
    SimCapture later(kSmall);
    CaptureRequest request = later.Request(temp.path() / "a");
    request.resume = true;
    CaptureControl control;
    ASSERT_TRUE(Ok(RunCapture(later.station, request, control)));
    SCOPED_TRACE(cancel_at);
    ExpectReplaysToItself(temp.path() / "a", temp.path() / "b");
  }
}

TEST(Replay, WhatTheRecordingDoesNotHoldIsAClearFault) {
  TempFolder temp;
  SimCapture sim(kSmall);
  CaptureControl control;
  ASSERT_TRUE(Ok(RunCapture(sim.station, sim.Request(temp.path() / "a"), control)));
  const auto script = ReplayScript::Open(temp.path() / "a");
  ASSERT_TRUE(Ok(script));
  Station station = MakeReplayStation(*script);

  const auto moved = station.motion->MoveTo({17, 3, "a0"}, {});
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::device);
  EXPECT_NE(moved.error().what.find("the recording has no move to 17 deg"), std::string::npos);
  EXPECT_FALSE(station.motion->Home({}));
  EXPECT_FALSE(station.cameras.at("c0")->Grab({}));
  EXPECT_FALSE(station.cameras.at("c0")->Configure({}));

  // Another plan leaves the recording and ends in a fault that says so.
  auto request = RequestOfRecording(*script, temp.path() / "b");
  ASSERT_TRUE(Ok(request));
  for (PlannedView& view : request->document.views) view.turntable_deg += 1;
  const auto report = RunCapture(station, *request, control);
  ASSERT_TRUE(Ok(report));
  EXPECT_EQ(report->outcome, CaptureOutcome::faulted);
  EXPECT_NE(report->fault->what.find("the recording has no"), std::string::npos);

  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(station.motion->Home(stop.get_token()).error().kind, ErrorKind::cancelled);
  EXPECT_EQ(station.cameras.at("c0")->Grab(stop.get_token()).error().kind, ErrorKind::cancelled);
}

TEST(Replay, AnAlteredPictureIsNotPassedOn) {
  TempFolder temp;
  SimCapture sim(kSmall);
  CaptureControl control;
  ASSERT_TRUE(Ok(RunCapture(sim.station, sim.Request(temp.path() / "a"), control)));
  std::ofstream(temp.path() / "a/frames/v001_c0.png", std::ios::app) << "x";
  const auto reports = ReplaySession(temp.path() / "a", temp.path() / "b");
  const Status same = CompareSessions(temp.path() / "a", temp.path() / "b");
  EXPECT_FALSE(same);
  ASSERT_TRUE(reports || reports.error().kind == ErrorKind::device);
}

TEST(CompareSessions, NamesTheFirstDifference) {
  TempFolder temp;
  SimCapture sim(kSmall);
  CaptureControl control;
  ASSERT_TRUE(Ok(RunCapture(sim.station, sim.Request(temp.path() / "a"), control)));
  fs::copy(temp.path() / "a", temp.path() / "b", fs::copy_options::recursive);
  fs::create_directories(temp.path() / "b/derived/masks");
  std::ofstream(temp.path() / "b/derived/masks/v000_c0.png") << "x";
  EXPECT_TRUE(Ok(CompareSessions(temp.path() / "a", temp.path() / "b")));
  std::ofstream(temp.path() / "b/log.jsonl", std::ios::app) << "x";
  const Status differs = CompareSessions(temp.path() / "a", temp.path() / "b");
  ASSERT_FALSE(differs);
  EXPECT_NE(differs.error().what.find("log.jsonl differs"), std::string::npos);
  fs::remove(temp.path() / "b/frames/v000_c0.png");
  EXPECT_FALSE(CompareSessions(temp.path() / "a", temp.path() / "b"));
}

}  // namespace
}  // namespace scan
