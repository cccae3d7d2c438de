// The state machine that captures a session: home, background plates, views, end.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/plan/framing.h"
#include "acquisition/runner/capture_control.h"
#include "acquisition/runner/capture_observer.h"
#include "acquisition/session/session_document.h"
#include "drivers/base/result.h"
#include "drivers/station/station.h"

namespace scan {

enum class SpecimenAction { remove, place };

std::string_view NameOf(SpecimenAction action);  // "remove" "place", as in the log

struct PromptAnswer {
  bool confirmed = true;  // false: the plates are skipped (remove), or the run ends (place)
  std::string note;       // goes into the log
};

// Asks for the specimen to be taken off the platter or put back: the simulated world does it, an
// operator confirms it. Returns cancelled when `stop` is requested.
using SpecimenPrompt = std::function<Result<PromptAnswer>(SpecimenAction, std::stop_token)>;

enum class OnFailedView { go_on, end };

struct CaptureOptions {
  int max_attempts = 3;  // tries of one plate or view, homings after a motion fault; 1 to 100
  OnFailedView on_failed_view = OnFailedView::go_on;
  double settings_tolerance_rel = 0.01;  // applied against asked; sensors round to whole lines
};

struct FramingCheck {
  BoundingCylinder specimen;
  double margin_px = 0;
};

struct CaptureRequest {
  std::filesystem::path folder;  // must not exist, or holds the session to go on with
  bool resume = false;           // take only the views that `folder` has no frame of
  SessionDocument document;      // created_utc_ns is stamped by the run; not read on resume
  CaptureOptions options;
  std::optional<FramingCheck> framing;  // refuses the plan before anything moves
  SpecimenPrompt prompt;                // none: no background plates, with a note
};

enum class CaptureOutcome {
  complete,    // every view has an accepted frame
  incomplete,  // went to the end, some views failed
  cancelled,   // can be resumed
  faulted      // a device fault ended it; can be resumed
};

std::string_view NameOf(CaptureOutcome outcome);  // "complete" ...

struct FailedView {
  std::string view;
  std::string reason;
};

struct CaptureReport {
  CaptureOutcome outcome = CaptureOutcome::complete;
  std::filesystem::path folder;
  std::size_t view_count = 0;
  std::size_t views_accepted = 0;  // with those of the runs before, on resume
  std::vector<FailedView> failed;
  std::size_t frames_rejected = 0;  // in this run
  std::optional<Error> fault;       // of a faulted run
};

// Captures the planned views on the station and writes them as a session folder. A frame counts
// only when it passes the gate (acquisition/quality); a rejected one is kept beside the session's
// frames, logged and taken again. Every answer of a device that the run depends on is in the log.
// Preconditions: the document names only cameras of the station.
// Errors: bad_input before any device is touched (plan, framing, folder); failed when the session
// cannot be written. What devices cause is in the report, and the session stays valid.
// Thread contract: one capture on a station at a time; `control` may be used from any thread.
Result<CaptureReport> RunCapture(Station& station, const CaptureRequest& request,
                                 CaptureControl& control, CaptureObserver* observer = nullptr);

}  // namespace scan
