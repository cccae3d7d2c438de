#include "acquisition/runner/runner.h"

#include <fmt/format.h>

#include <set>

#include "acquisition/plan/ring_plan.h"
#include "acquisition/runner/capture_run.h"
#include "acquisition/runner/journal.h"
#include "acquisition/runner/run_history.h"
#include "acquisition/runner/run_words.h"
#include "acquisition/session/session_reader.h"
#include "acquisition/session/session_writer.h"

namespace scan {
namespace {

Status CheckOptions(const CaptureOptions& options) {
  if (options.max_attempts < 1 || options.max_attempts > 100)
    return BadInput(fmt::format("max_attempts {} is out of range", options.max_attempts),
                    "capture options", "give 1 to 100");
  if (!(options.settings_tolerance_rel >= 0 && options.settings_tolerance_rel <= 1))
    return BadInput(
        fmt::format("settings_tolerance_rel {} is out of range", options.settings_tolerance_rel),
        "capture options", "give 0 to 1");
  return {};
}

// What this state machine cannot do yet is refused, not skipped.
Status CheckAbilities(const SessionDocument& document) {
  std::set<std::string> mountings, aims;
  for (const PlannedView& view : document.views) {
    mountings.insert(view.mounting_id);
    aims.insert(view.aim_id);
    if (view.slices != 1)
      return BadInput(
          fmt::format("view {} asks for {} slices, but no focus axis exists", view.id, view.slices),
          "plan", "plan one slice a view");
  }
  if (mountings.size() > 1)
    return BadInput("the plan has several mountings", "plan",
                    "capture each mounting as a session of its own");
  if (document.station.lift.kind == LiftKind::manual_aim && aims.size() > 1)
    return BadInput("the plan has several aims, but this camera is aimed by hand", "plan",
                    "capture each aim as a session of its own");
  return {};
}

Status CheckStation(const Station& station, const SessionDocument& document) {
  if (!station.clock || !station.motion)
    return BadInput("the station has no clock or no motion", "station",
                    "name a motion device in the station file");
  for (const PlannedView& view : document.views) {
    const auto camera = station.cameras.find(view.camera);
    if (camera == station.cameras.end() || !camera->second)
      return BadInput("the station has no camera '" + view.camera + "'", "view " + view.id,
                      "name a camera of the station file");
  }
  for (const CameraDocument& planned : document.station.cameras) {
    const auto camera = station.cameras.find(planned.id);
    if (camera == station.cameras.end()) continue;
    const CameraInfo& info = camera->second->Info();
    if (info.w != planned.intrinsics.w || info.h != planned.intrinsics.h)
      return BadInput(
          fmt::format("camera {} gives {} x {} pixels, its intrinsics say {} x {}", planned.id,
                      info.w, info.h, planned.intrinsics.w, planned.intrinsics.h),
          "station", "correct the camera's intrinsics in the station file");
  }
  return {};
}

Status CheckPlan(const Station& station, const CaptureRequest& request,
                 const SessionDocument& document) {
  SCAN_CHECK(CheckOptions(request.options));
  SCAN_CHECK(CheckViews(document.views));
  SCAN_CHECK(ValidateSessionDocument(document, "capture request"));
  SCAN_CHECK(CheckAbilities(document));
  SCAN_CHECK(CheckStation(station, document));
  if (request.framing) {
    SCAN_CHECK(CheckFraming(document.views, document.station, request.framing->specimen,
                            request.framing->margin_px));
  }
  return {};
}

struct OpenSession {
  Journal journal;
  RunHistory history;
};

Result<OpenSession> CreateNew(const Station& station, const CaptureRequest& request) {
  SCAN_CHECK(CheckPlan(station, request, request.document));
  const Timestamp now = station.clock->Now();
  SessionDocument document = request.document;
  document.created_utc_ns = now.utc_ns;
  SCAN_TRY(SessionWriter writer, CreateSession(request.folder, document, now));
  return OpenSession{Journal(std::move(writer), station.clock), {}};
}

Result<OpenSession> GoOn(const Station& station, const CaptureRequest& request) {
  SCAN_TRY(const Session session, ReadSession(request.folder));
  SCAN_CHECK(CheckPlan(station, request, session.state.document()));
  const Timestamp now = station.clock->Now();
  SCAN_TRY(SessionWriter writer, ResumeSession(request.folder, now));
  SCAN_CHECK(writer.Append(ResumeEntry{run_words::kAfterInterruption}, now));
  return OpenSession{Journal(std::move(writer), station.clock), HistoryOf(session.log)};
}

}  // namespace

std::string_view NameOf(CaptureState state) {
  switch (state) {
    case CaptureState::starting:
      return "starting";
    case CaptureState::homing:
      return "homing";
    case CaptureState::plate:
      return "plate";
    case CaptureState::moving:
      return "moving";
    case CaptureState::grabbing:
      return "grabbing";
    case CaptureState::paused:
      return "paused";
    case CaptureState::ending:
      return "ending";
  }
  return "starting";
}

std::string_view NameOf(SpecimenAction action) {
  return action == SpecimenAction::remove ? run_words::kRemove : run_words::kPlace;
}

std::string_view NameOf(CaptureOutcome outcome) {
  switch (outcome) {
    case CaptureOutcome::complete:
      return "complete";
    case CaptureOutcome::incomplete:
      return "incomplete";
    case CaptureOutcome::cancelled:
      return "cancelled";
    case CaptureOutcome::faulted:
      return "faulted";
  }
  return "faulted";
}

Result<CaptureReport> RunCapture(Station& station, const CaptureRequest& request,
                                 CaptureControl& control, CaptureObserver* observer) {
  if (!station.clock) return BadInput("the station has no clock", "station", "give it one");
  SCAN_TRY(OpenSession open, request.resume ? GoOn(station, request) : CreateNew(station, request));
  CaptureRun run(station, request, open.history, open.journal, control, observer);
  auto report = run.Run();
  // When the session cannot be written the run breaks off anywhere: leave no lamp burning.
  if (!report && station.light) static_cast<void>(station.light->Set(false));
  return report;
}

}  // namespace scan
