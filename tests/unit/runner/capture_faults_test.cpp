// Every device call fails once, and from some call on for good.
#include <gtest/gtest.h>

#include "acquisition/runner/runner.h"
#include "acquisition/session/session_reader.h"
#include "tests/support/failing_station.h"
#include "tests/support/sim_capture.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

struct FailingRun {
  Result<CaptureReport> report;
  int calls = 0;
};

FailingRun CaptureFailing(const std::filesystem::path& folder, int fail_at, int fail_count) {
  SimCapture sim({.w = 48, .h = 32, .views_a_ring = 2});
  auto plan = std::make_shared<CallPlan>();
  plan->fail_at = fail_at;
  plan->fail_count = fail_count;
  Station station = MakeFailing(std::move(sim.station), plan);
  CaptureControl control;
  auto report = RunCapture(station, sim.Request(folder), control);
  return {std::move(report), plan->calls};
}

int CallsOfAGoodRun() {
  TempFolder temp;
  return CaptureFailing(temp.path() / "s", 0, 0).calls;
}

void ExpectResumable(const std::filesystem::path& folder) {
  SimCapture sim({.w = 48, .h = 32, .views_a_ring = 2});
  CaptureRequest request = sim.Request(folder);
  request.resume = true;
  CaptureControl control;
  const auto report = RunCapture(sim.station, request, control);
  ASSERT_TRUE(Ok(report));
  EXPECT_EQ(report->outcome, CaptureOutcome::complete);
}

TEST(CaptureFaults, OneFailedCallIsLoggedAndTheRunRecovers) {
  const int calls = CallsOfAGoodRun();
  ASSERT_GT(calls, 15);
  for (int at = 1; at <= calls; ++at) {
    TempFolder temp;
    const FailingRun run = CaptureFailing(temp.path() / "s", at, 1);
    ASSERT_TRUE(Ok(run.report)) << at;
    EXPECT_EQ(run.report->outcome, CaptureOutcome::complete) << at;
    const auto session = ReadSession(temp.path() / "s");
    ASSERT_TRUE(Ok(session)) << at;
    int faults = 0;
    for (const LogEntry& entry : session->log)
      if (const auto* fault = std::get_if<FaultEntry>(&entry.payload)) {
        ++faults;
        EXPECT_EQ(fault->what, "injected fault");
      }
    EXPECT_EQ(faults, 1) << at;
  }
}

TEST(CaptureFaults, AStationThatDiesEndsInAClearFaultAndCanBeResumed) {
  const int calls = CallsOfAGoodRun();
  for (int at = 1; at <= calls; ++at) {
    TempFolder temp;
    const FailingRun run = CaptureFailing(temp.path() / "s", at, 1 << 20);
    ASSERT_TRUE(Ok(run.report)) << at;
    ASSERT_TRUE(Ok(ReadSession(temp.path() / "s"))) << at;
    if (at < calls) {  // the last call is the lamp going off
      EXPECT_NE(run.report->outcome, CaptureOutcome::complete) << at;
      EXPECT_TRUE(run.report->fault || !run.report->failed.empty()) << at;
    }
    if (run.report->outcome == CaptureOutcome::faulted) {
      ASSERT_TRUE(run.report->fault) << at;
      EXPECT_NE(ToString(*run.report->fault).find("injected fault"), std::string::npos) << at;
    }
    ExpectResumable(temp.path() / "s");
  }
}

}  // namespace
}  // namespace scan
