#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>

#include "acquisition/runner/runner.h"
#include "acquisition/session/session_reader.h"
#include "tests/support/failing_station.h"
#include "tests/support/sim_capture.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

std::map<std::string, int> CountTypes(const Session& session) {
  std::map<std::string, int> counts;
  for (const LogEntry& entry : session.log) ++counts[std::string(TypeName(entry.payload))];
  return counts;
}

class Watcher final : public CaptureObserver {
 public:
  explicit Watcher(std::function<void(const CaptureProgress&)> on_progress)
      : on_progress_(std::move(on_progress)) {}
  void OnProgress(const CaptureProgress& progress) override { on_progress_(progress); }

 private:
  std::function<void(const CaptureProgress&)> on_progress_;
};

TEST(CaptureRun, TakesEveryViewAfterTheBackgroundPlates) {
  TempFolder temp;
  SimCapture sim;
  CaptureControl control;
  std::vector<CaptureProgress> progress;
  Watcher watcher([&](const CaptureProgress& p) { progress.push_back(p); });
  const auto report = RunCapture(sim.station, sim.Request(temp.path() / "s"), control, &watcher);
  ASSERT_TRUE(Ok(report));
  EXPECT_EQ(report->outcome, CaptureOutcome::complete);
  EXPECT_EQ(report->views_accepted, 6u);
  EXPECT_TRUE(report->failed.empty());

  const auto session = ReadSession(temp.path() / "s");
  ASSERT_TRUE(Ok(session));
  EXPECT_EQ(session->state.plates().size(), 2u);
  auto counts = CountTypes(*session);
  EXPECT_EQ(counts["frame"], 6);
  EXPECT_EQ(counts["move"], 8);
  EXPECT_EQ(counts["settle"], 8);
  EXPECT_EQ(counts["home"], 1);
  EXPECT_EQ(counts["reject"], 0);
  EXPECT_TRUE(std::holds_alternative<EndEntry>(session->log.back().payload));
  EXPECT_EQ(session->document.created_utc_ns, session->log.front().time.utc_ns);

  ASSERT_FALSE(progress.empty());
  EXPECT_EQ(progress.back().views_accepted, 6u);
  EXPECT_EQ(progress.back().view_count, 6u);
  EXPECT_TRUE(std::filesystem::exists(progress.back().last_picture));
}

TEST(CaptureRun, EveryFrameBeganAfterTheAxesSettled) {
  TempFolder temp;
  SimCapture sim({.late_frames = 1});
  CaptureControl control;
  ASSERT_TRUE(Ok(RunCapture(sim.station, sim.Request(temp.path() / "s"), control)));
  const auto session = ReadSession(temp.path() / "s");
  ASSERT_TRUE(Ok(session));
  std::int64_t settled = 0;
  for (const LogEntry& entry : session->log) {
    if (const auto* settle = std::get_if<SettleEntry>(&entry.payload))
      settled = settle->settled_mono_ns;
    if (const auto* frame = std::get_if<FrameEntry>(&entry.payload)) {
      EXPECT_GE(frame->exposure->not_before_ns, settled);
    }
  }
}

TEST(CaptureRun, ALateFrameIsRejectedKeptAndTakenAgain) {
  TempFolder temp;
  SimCapture sim({.late_frames = 1});
  CaptureControl control;
  const auto report = RunCapture(sim.station, sim.Request(temp.path() / "s"), control);
  ASSERT_TRUE(Ok(report));
  EXPECT_EQ(report->outcome, CaptureOutcome::complete);
  EXPECT_EQ(report->frames_rejected, 1u);
  const auto session = ReadSession(temp.path() / "s");
  ASSERT_TRUE(Ok(session));
  const auto reject = std::find_if(session->log.begin(), session->log.end(), [](const auto& e) {
    return std::holds_alternative<RejectEntry>(e.payload);
  });
  ASSERT_NE(reject, session->log.end());
  const auto& entry = std::get<RejectEntry>(reject->payload);
  EXPECT_EQ(entry.cause, "before_settled");
  ASSERT_EQ(entry.files.size(), 1u);
  EXPECT_TRUE(std::filesystem::exists(temp.path() / "s" / entry.files[0].path));
  EXPECT_TRUE(std::holds_alternative<RetryEntry>((reject + 1)->payload));
}

TEST(CaptureRun, AViewThatNeverPassesFailsLoudly) {
  for (const OnFailedView policy : {OnFailedView::go_on, OnFailedView::end}) {
    TempFolder temp;
    SimCapture sim({.late_frames = 3});
    CaptureRequest request = sim.Request(temp.path() / "s");
    request.options.on_failed_view = policy;
    CaptureControl control;
    const auto report = RunCapture(sim.station, request, control);
    ASSERT_TRUE(Ok(report));
    ASSERT_EQ(report->failed.size(), 1u);
    EXPECT_EQ(report->failed[0].view, "v000");
    EXPECT_NE(report->failed[0].reason.find("before the axes settled"), std::string::npos);
    const bool ends = policy == OnFailedView::end;
    EXPECT_EQ(report->outcome, ends ? CaptureOutcome::faulted : CaptureOutcome::incomplete);
    EXPECT_EQ(report->views_accepted, ends ? 0u : 5u);
    // The view is taken when the session goes on.
    request.resume = true;
    CaptureControl again;
    SimCapture later;
    request.prompt = later.Request({}).prompt;
    const auto resumed = RunCapture(later.station, request, again);
    ASSERT_TRUE(Ok(resumed));
    EXPECT_EQ(resumed->outcome, CaptureOutcome::complete);
    EXPECT_EQ(resumed->views_accepted, 6u);
  }
}

TEST(CaptureRun, WithoutPromptThereAreNoPlatesAndANoteSaysSo) {
  TempFolder temp;
  SimCapture sim;
  CaptureRequest request = sim.Request(temp.path() / "s");
  request.prompt = nullptr;
  CaptureControl control;
  ASSERT_TRUE(Ok(RunCapture(sim.station, request, control)));
  const auto session = ReadSession(temp.path() / "s");
  ASSERT_TRUE(Ok(session));
  EXPECT_TRUE(session->state.plates().empty());
  EXPECT_TRUE(std::any_of(session->log.begin(), session->log.end(), [](const auto& entry) {
    const auto* note = std::get_if<NoteEntry>(&entry.payload);
    return note && note->text.find("no background plates") != std::string::npos;
  }));
}

TEST(CaptureRun, AnOperatorMaySkipThePlatesButMustPutTheSpecimenBack) {
  TempFolder temp;
  SimCapture sim;
  CaptureRequest request = sim.Request(temp.path() / "skipped");
  request.prompt = [](SpecimenAction, std::stop_token) {
    return PromptAnswer{false, "glued to its pin"};
  };
  CaptureControl control;
  auto report = RunCapture(sim.station, request, control);
  ASSERT_TRUE(Ok(report));
  EXPECT_EQ(report->outcome, CaptureOutcome::complete);

  request.folder = temp.path() / "lost";
  request.prompt = [](SpecimenAction action, std::stop_token) {
    return PromptAnswer{action == SpecimenAction::remove, ""};
  };
  report = RunCapture(sim.station, request, control);
  ASSERT_TRUE(Ok(report));
  EXPECT_EQ(report->outcome, CaptureOutcome::faulted);
  ASSERT_TRUE(report->fault);
  EXPECT_NE(report->fault->what.find("not put back"), std::string::npos);
}

TEST(CaptureRun, CancelledAtEveryViewTheSessionIsResumedToTheEnd) {
  for (int cancel_at = 0; cancel_at < 6; ++cancel_at) {
    TempFolder temp;
    const std::string view = "v00" + std::to_string(cancel_at);
    {
      SimCapture sim;
      CaptureControl control;
      Watcher watcher([&](const CaptureProgress& p) {
        if (p.view == view && p.state == CaptureState::moving) control.Cancel();
      });
      const auto report =
          RunCapture(sim.station, sim.Request(temp.path() / "s"), control, &watcher);
      ASSERT_TRUE(Ok(report));
      EXPECT_EQ(report->outcome, CaptureOutcome::cancelled);
      EXPECT_EQ(report->views_accepted, static_cast<std::size_t>(cancel_at));
    }
    const auto stopped = ReadSession(temp.path() / "s");
    ASSERT_TRUE(Ok(stopped));
    EXPECT_EQ(std::get<EndEntry>(stopped->log.back().payload).result, EndResult::stopped);

    SimCapture later;
    CaptureRequest request = later.Request(temp.path() / "s");
    request.resume = true;
    CaptureControl control;
    const auto resumed = RunCapture(later.station, request, control);
    ASSERT_TRUE(Ok(resumed));
    EXPECT_EQ(resumed->outcome, CaptureOutcome::complete);
    const auto session = ReadSession(temp.path() / "s");
    ASSERT_TRUE(Ok(session));
    for (const PlannedView& planned : session->state.views()) {
      ASSERT_TRUE(session->state.Complete(planned));
      // One homing, one epoch.
      EXPECT_EQ(session->state.Frame(planned.id, 0)->reference_epoch, planned.id < view ? 1 : 2);
    }
  }
}

TEST(CaptureRun, CancelReachesADeviceCallUnderWay) {
  // Cancelled from inside every device call, one after the other.
  int calls = 0;
  {
    TempFolder temp;
    SimCapture sim({.views_a_ring = 1});
    auto plan = std::make_shared<CallPlan>();
    Station station = MakeFailing(std::move(sim.station), plan);
    CaptureControl control;
    ASSERT_TRUE(Ok(RunCapture(station, sim.Request(temp.path() / "s"), control)));
    calls = plan->calls;
  }
  ASSERT_GT(calls, 10);
  for (int at = 1; at < calls; ++at) {
    TempFolder temp;
    SimCapture sim({.views_a_ring = 1});
    auto plan = std::make_shared<CallPlan>();
    Station station = MakeFailing(std::move(sim.station), plan);
    CaptureControl control;
    plan->before_call = [&](int call) {
      if (call == at) control.Cancel();
    };
    const auto report = RunCapture(station, sim.Request(temp.path() / "s"), control);
    ASSERT_TRUE(Ok(report));
    EXPECT_EQ(report->outcome, CaptureOutcome::cancelled) << at;
    EXPECT_LE(plan->calls, at + 1) << "only the lamp is switched off after call " << at;
  }
}

TEST(CaptureRun, PausesBetweenDeviceCallsAndGoesOn) {
  TempFolder temp;
  SimCapture sim;
  CaptureControl control;
  int pauses = 0;
  Watcher watcher([&](const CaptureProgress& p) {
    if (p.view == "v002" && p.state == CaptureState::moving && pauses == 0) control.Pause();
    if (p.state == CaptureState::paused) {
      ++pauses;
      control.Resume();
    }
  });
  const auto report = RunCapture(sim.station, sim.Request(temp.path() / "s"), control, &watcher);
  ASSERT_TRUE(Ok(report));
  EXPECT_EQ(report->outcome, CaptureOutcome::complete);
  EXPECT_EQ(pauses, 1);
  const auto session = ReadSession(temp.path() / "s");
  ASSERT_TRUE(Ok(session));
  auto counts = CountTypes(*session);
  EXPECT_EQ(counts["pause"], 1);
  EXPECT_EQ(counts["resume"], 1);
}

TEST(CaptureRun, RefusesABadRequestBeforeAnyDeviceIsTouched) {
  TempFolder temp;
  SimCapture sim;
  auto plan = std::make_shared<CallPlan>();
  Station station = MakeFailing(std::move(sim.station), plan);
  const CaptureRequest good = sim.Request(temp.path() / "s");
  std::vector<CaptureRequest> bad(8, good);
  bad[0].document.views.clear();
  bad[1].document.views[1].id = bad[1].document.views[0].id;
  bad[2].document.views[0].camera = "c9";
  bad[3].document.station.cameras[0].intrinsics.w += 1;
  bad[4].document.views[0].slices = 3;
  bad[5].document.views[0].mounting_id = "m1";
  bad[6].options.max_attempts = 0;
  bad[7].framing = FramingCheck{{400, 0, 50}, 0};
  for (std::size_t i = 0; i < bad.size(); ++i) {
    CaptureControl control;
    const auto report = RunCapture(station, bad[i], control);
    ASSERT_FALSE(report) << i;
    EXPECT_EQ(report.error().kind, ErrorKind::bad_input) << i << ToString(report.error());
    EXPECT_FALSE(std::filesystem::exists(good.folder)) << i;
  }
  CaptureControl control;
  std::filesystem::create_directories(good.folder);
  std::ofstream(good.folder / "something") << "x";
  EXPECT_FALSE(RunCapture(station, good, control));
  CaptureRequest resume = good;
  resume.resume = true;
  EXPECT_FALSE(RunCapture(station, resume, control));
  EXPECT_EQ(plan->calls, 0);
}

}  // namespace
}  // namespace scan
