// One run of the capture's state machine over an open session.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "acquisition/quality/frame_gate.h"
#include "acquisition/runner/journal.h"
#include "acquisition/runner/run_history.h"
#include "acquisition/runner/runner.h"

namespace scan {

// Holds one frame at a time. Between two documents of the log there is at most one device call
// whose success leaves no document (light, configure); its failure is the next document.
// Thread contract: Run from one thread.
class CaptureRun {
 public:
  CaptureRun(Station& station, const CaptureRequest& request, const RunHistory& history,
             Journal& journal, CaptureControl& control, CaptureObserver* observer);

  // From light on to the end document. Errors: failed when the session cannot be written.
  Result<CaptureReport> Run();

 private:
  // How a step of the run went; an error beside it means that the session cannot be written.
  enum class Step { done, view_failed, cancelled, faulted };

  // One exposure to be taken: of a view, or of its background.
  struct Shot {
    const PlannedView& view;
    bool plate = false;
    std::string Name() const;  // for people
    std::string LoggedView() const { return plate ? std::string() : view.id; }
  };

  Result<Step> Work();
  Result<Step> LightOn();
  Result<Step> Home();
  Result<Step> TakePlates();
  Result<Step> TakePlate(const PlannedView& view);
  Result<Step> TakeViews();
  Result<Step> TakeView(const PlannedView& view);
  Result<Step> Prompt(SpecimenAction action, PromptAnswer& answer);
  Result<Step> Move(const Shot& shot);
  Result<Step> Take(const Shot& shot);
  // One configure and grab; `why` receives what was wrong with a frame that did not count.
  Result<Step> TryOnce(const Shot& shot, std::string& why, bool& again);
  Result<Step> Judge(const Shot& shot, const Frame& frame, std::string& why);
  Status LogGood(const Shot& shot, const Frame& frame);
  Result<Step> Finish(Step step);

  // Between device calls: pauses, or ends the run, when that was asked for.
  Result<Step> Checkpoint();
  // Repeats a device call that fails, up to the limit; the last failure ends the run.
  Result<Step> Insist(const char* device, const char* call, const std::function<Status()>& once);
  // Logs a failed device call; `cancelled` when it was stopped, else `done`.
  Result<Step> LogDeviceError(const std::string& device, const char* call, const std::string& view,
                              const Error& error);
  Status LogRetry(const Shot* shot, int attempt, const std::string& why);
  Result<Step> FailView(const Shot& shot, const std::string& why);
  Step End(const Error& fault);
  void Notify(CaptureState state, std::string message);
  std::vector<const PlannedView*> MissingPlates() const;
  const CameraDocument& CameraOf(const PlannedView& view) const;

  Station& station_;
  const CaptureOptions& options_;
  const SpecimenPrompt& prompt_;
  Journal& journal_;
  CaptureControl& control_;
  CaptureObserver* observer_;

  CaptureReport report_;
  CaptureProgress progress_;
  RunHistory history_;
  std::vector<PlannedView> todo_;
  MoveReport stage_;                           // after the last move
  std::map<std::string, FrameIdentity> last_;  // by camera
  std::string aim_id_;                         // of the view before
};

}  // namespace scan
