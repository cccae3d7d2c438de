#include "acquisition/runner/capture_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "acquisition/runner/run_words.h"

namespace scan {
namespace {

namespace words = run_words;

bool MayHelpToRepeat(const Error& error) { return error.kind != ErrorKind::bad_input; }

}  // namespace

std::string CaptureRun::Shot::Name() const {
  return plate ? fmt::format("background plate of aim {}, camera {}", view.aim_id, view.camera)
               : "view " + view.id;
}

CaptureRun::CaptureRun(Station& station, const CaptureRequest& request, const RunHistory& history,
                       Journal& journal, CaptureControl& control, CaptureObserver* observer)
    : station_(station),
      options_(request.options),
      prompt_(request.prompt),
      journal_(journal),
      control_(control),
      observer_(observer),
      history_(history) {
  report_.folder = request.folder;
  report_.view_count = journal.state().views().size();
  for (const PlannedView& view : journal.state().views()) {
    if (journal.state().Complete(view))
      ++report_.views_accepted;
    else
      todo_.push_back(view);
  }
}

Result<CaptureReport> CaptureRun::Run() {
  SCAN_CHECK(journal_.Append(NoteOf(options_)));
  SCAN_TRY(const Step step, Work());
  SCAN_TRY(const Step last, Finish(step));
  switch (last) {
    case Step::cancelled:
      report_.outcome = CaptureOutcome::cancelled;
      break;
    case Step::faulted:
      report_.outcome = CaptureOutcome::faulted;
      break;
    default:
      report_.outcome = report_.views_accepted == report_.view_count ? CaptureOutcome::complete
                                                                     : CaptureOutcome::incomplete;
  }
  return std::move(report_);
}

Result<CaptureRun::Step> CaptureRun::Work() {
  using Stage = Result<Step> (CaptureRun::*)();
  for (const Stage stage : {&CaptureRun::LightOn, &CaptureRun::Home, &CaptureRun::TakePlates}) {
    SCAN_TRY(const Step step, (this->*stage)());
    if (step != Step::done) return step;
  }
  return TakeViews();
}

Result<CaptureRun::Step> CaptureRun::LightOn() {
  Notify(CaptureState::starting, "light on");
  if (!station_.light) return Step::done;
  return Insist(words::kLight, words::kOn, [this] { return station_.light->Set(true); });
}

Result<CaptureRun::Step> CaptureRun::Home() {
  Notify(CaptureState::homing, "homing");
  HomeReport home;
  SCAN_TRY(const Step step, Insist(words::kMotion, words::kHome, [&]() -> Status {
             SCAN_TRY(home, station_.motion->Home(control_.stop_token()));
             return {};
           }));
  if (step != Step::done) return step;
  // Counted by session, not by device: a device begins at 1 again when its program restarts.
  ++history_.reference_epoch;
  SCAN_CHECK(journal_.Append(HomeEntry{history_.reference_epoch, home.position}));
  return Step::done;
}

std::vector<const PlannedView*> CaptureRun::MissingPlates() const {
  std::set<std::pair<std::string, std::string>> known;  // aim, camera
  for (const PlateDocument& plate : journal_.state().plates())
    if (plate.plate == PlateKind::background) known.insert({plate.aim_id, plate.camera});
  std::vector<const PlannedView*> missing;
  for (const PlannedView& view : todo_)
    if (known.insert({view.aim_id, view.camera}).second) missing.push_back(&view);
  return missing;
}

Result<CaptureRun::Step> CaptureRun::TakePlates() {
  const auto missing = MissingPlates();
  if (!missing.empty() && !prompt_) {
    NoteEntry note;
    note.text = "no background plates: nobody is asked to take the specimen away";
    note.values = {{words::kPlatesKey, "none"}};
    SCAN_CHECK(journal_.Append(std::move(note)));
  }
  PromptAnswer answer;
  if (!missing.empty() && prompt_) {  // also where the log says that it is off: it may be back
    SCAN_TRY(const Step step, Prompt(SpecimenAction::remove, answer));
    if (step != Step::done) return step;
    history_.specimen_removed = answer.confirmed;
  }
  if (!history_.specimen_removed) return Step::done;
  if (!prompt_)
    return End(Error{ErrorKind::failed, "the specimen is still off the platter", "resume",
                     "resume with somebody to put it back (a specimen prompt)"});
  for (const PlannedView* view : missing) {
    SCAN_TRY(const Step step, TakePlate(*view));
    if (step == Step::view_failed && options_.on_failed_view == OnFailedView::go_on) continue;
    if (step != Step::done) return step == Step::view_failed ? Step::faulted : step;
  }
  SCAN_TRY(const Step step, Prompt(SpecimenAction::place, answer));
  if (step != Step::done) return step;
  if (!answer.confirmed)
    return End(Error{ErrorKind::failed, "the specimen was not put back", "specimen prompt",
                     "put it back and resume the session"});
  history_.specimen_removed = false;
  return Step::done;
}

Result<CaptureRun::Step> CaptureRun::Prompt(SpecimenAction action, PromptAnswer& answer) {
  const bool remove = action == SpecimenAction::remove;
  Notify(CaptureState::plate, remove ? "take the specimen off the platter" : "put it back");
  SCAN_TRY(const Step step,
           Insist(words::kPrompt, remove ? words::kRemove : words::kPlace, [&]() -> Status {
             SCAN_TRY(answer, prompt_(action, control_.stop_token()));
             return {};
           }));
  if (step != Step::done) return step;
  SCAN_CHECK(journal_.Append(NoteOf(action, answer)));
  return Step::done;
}

Result<CaptureRun::Step> CaptureRun::TakePlate(const PlannedView& view) {
  const Shot shot{view, true};
  SCAN_TRY(const Step moved, Move(shot));
  if (moved != Step::done) return moved;
  Notify(CaptureState::plate, shot.Name());
  return Take(shot);
}

Result<CaptureRun::Step> CaptureRun::TakeViews() {
  for (const PlannedView& view : todo_) {
    progress_.view = view.id;
    SCAN_TRY(const Step step, TakeView(view));
    if (step == Step::done) continue;
    if (step != Step::view_failed) return step;
    if (options_.on_failed_view == OnFailedView::end) return Step::faulted;
  }
  return Step::done;
}

Result<CaptureRun::Step> CaptureRun::TakeView(const PlannedView& view) {
  const Shot shot{view, false};
  if (view.aim_id != aim_id_) {
    SCAN_TRY(const Step step, Checkpoint());
    if (step != Step::done) return step;
    SCAN_CHECK(journal_.Append(AimEntry{view.aim_id, view.camera, {}, {}}));
    aim_id_ = view.aim_id;
  }
  Notify(CaptureState::moving,
         fmt::format("to {:g} deg, {:g} mm", view.turntable_deg, view.lift_mm));
  SCAN_TRY(const Step moved, Move(shot));
  if (moved != Step::done) return moved;
  Notify(CaptureState::grabbing, "taking view " + view.id);
  return Take(shot);
}

Result<CaptureRun::Step> CaptureRun::Move(const Shot& shot) {
  const StageTarget target{shot.view.turntable_deg, shot.view.lift_mm, shot.view.aim_id};
  for (int attempt = 1;; ++attempt) {
    SCAN_TRY(const Step go, Checkpoint());
    if (go != Step::done) return go;
    SCAN_CHECK(journal_.Append(MoveEntry{shot.LoggedView(), target}));
    auto moved = station_.motion->MoveTo(target, control_.stop_token());
    if (moved) {
      stage_ = *moved;
      SCAN_CHECK(journal_.Append(SettleEntry{stage_.settled_mono_ns, stage_.position}));
      return Step::done;
    }
    const Error error = moved.error();
    SCAN_TRY(const Step logged,
             LogDeviceError(words::kMotion, words::kMove, shot.LoggedView(), error));
    if (logged != Step::done) return logged;
    if (!MayHelpToRepeat(error)) return FailView(shot, ToString(error));
    if (attempt >= options_.max_attempts) return End(error);
    SCAN_CHECK(LogRetry(&shot, attempt + 1, error.what));
    // After a fault nobody knows where the axes stand.
    SCAN_TRY(const Step homed, Home());
    if (homed != Step::done) return homed;
  }
}

Result<CaptureRun::Step> CaptureRun::Take(const Shot& shot) {
  std::string why;
  for (int attempt = 1;; ++attempt) {
    bool again = true;
    SCAN_TRY(const Step step, TryOnce(shot, why, again));
    if (step != Step::view_failed) return step;
    if (!again || attempt >= options_.max_attempts)
      return FailView(
          shot, fmt::format("{} of {} tries, the last: {}", attempt, options_.max_attempts, why));
    SCAN_CHECK(LogRetry(&shot, attempt + 1, why));
  }
}

Result<CaptureRun::Step> CaptureRun::TryOnce(const Shot& shot, std::string& why, bool& again) {
  Camera& camera = *station_.cameras.at(shot.view.camera);
  CameraSettings asked;
  if (shot.view.exposure_us > 0) asked.exposure_us = shot.view.exposure_us;

  const auto failed = [&](const char* call, const Error& error) -> Result<Step> {
    SCAN_TRY(const Step logged, LogDeviceError(shot.view.camera, call, shot.LoggedView(), error));
    if (logged != Step::done) return logged;
    why = ToString(error);
    again = MayHelpToRepeat(error);
    return Step::view_failed;
  };
  SCAN_TRY(const Step before_configure, Checkpoint());
  if (before_configure != Step::done) return before_configure;
  if (const auto configured = camera.Configure(asked); !configured)
    return failed(words::kConfigure, configured.error());
  SCAN_TRY(const Step before_grab, Checkpoint());
  if (before_grab != Step::done) return before_grab;
  const auto frame = camera.Grab(control_.stop_token());
  if (!frame) return failed(words::kGrab, frame.error());
  return Judge(shot, *frame, why);
}

Result<CaptureRun::Step> CaptureRun::Judge(const Shot& shot, const Frame& frame, std::string& why) {
  const CameraDocument& camera = CameraOf(shot.view);
  FrameDemand demand;
  demand.settled_mono_ns = stage_.settled_mono_ns;
  if (shot.view.exposure_us > 0) demand.asked.exposure_us = shot.view.exposure_us;
  demand.w = camera.intrinsics.w;
  demand.h = camera.intrinsics.h;
  demand.settings_tolerance_rel = options_.settings_tolerance_rel;
  FrameIdentity identity = IdentityOf(frame);
  if (const auto last = last_.find(camera.id); last != last_.end()) {
    demand.last = last->second;
    if (shot.plate) demand.last->sha256.clear();  // two empty backgrounds may well be equal
  }
  const auto rejection = FindRejection(frame, identity, demand);
  last_[camera.id] = std::move(identity);
  if (!rejection) {
    SCAN_CHECK(LogGood(shot, frame));
    return Step::done;
  }
  RejectEntry entry;
  (shot.plate ? entry.aim_id : entry.view) = shot.plate ? shot.view.aim_id : shot.view.id;
  entry.camera = camera.id;
  entry.cause = NameOf(rejection->cause);
  entry.reason = rejection->text;
  entry.sensor_sequence = frame.sensor_sequence;
  entry.exposure = frame.exposure;
  entry.applied = frame.applied;
  SCAN_CHECK(journal_.AppendReject(std::move(entry), frame.files));
  ++report_.frames_rejected;
  why = rejection->text;
  Notify(CaptureState::grabbing, shot.Name() + " rejected: " + why);
  return Step::view_failed;
}

Status CaptureRun::LogGood(const Shot& shot, const Frame& frame) {
  if (shot.plate) {
    PlateDocument plate;
    plate.camera = shot.view.camera;
    plate.aim_id = shot.view.aim_id;
    plate.applied = frame.applied;
    plate.sensor_sequence = frame.sensor_sequence;
    plate.exposure = frame.exposure;
    SCAN_CHECK(journal_.AppendPlate(std::move(plate), frame.files));
    progress_.last_picture = report_.folder / journal_.state().plates().back().files.front().path;
    Notify(CaptureState::plate, shot.Name() + " taken");
    return {};
  }
  FrameEntry entry;
  entry.view = shot.view.id;
  entry.camera = shot.view.camera;
  entry.sensor_sequence = frame.sensor_sequence;
  entry.exposure = frame.exposure;
  entry.applied = frame.applied;
  entry.reference_epoch = history_.reference_epoch;
  entry.axes = stage_.position;
  // An aim without nominal pose gives a frame without one.
  if (const auto pose =
          NominalPose(journal_.state().document().station, entry.camera, shot.view.aim_id,
                      stage_.position.turntable_deg.estimated, stage_.position.lift_mm.estimated))
    entry.camera_from_table = *pose;
  SCAN_CHECK(journal_.AppendFrame(std::move(entry), frame.files));
  ++report_.views_accepted;
  progress_.last_picture =
      report_.folder / journal_.state().Frame(shot.view.id, 0)->files.front().path;
  Notify(CaptureState::grabbing, shot.Name() + " taken");
  return {};
}

Result<CaptureRun::Step> CaptureRun::Finish(Step step) {
  Notify(CaptureState::ending, "ending");
  if (step == Step::cancelled) {
    SCAN_CHECK(journal_.Append(StopEntry{StopKind::stop, "cancelled"}));
  }
  if (station_.light) {
    // One try: the run is over, and the lamp's fault is in the log.
    if (const Status off = station_.light->Set(false); !off) {
      SCAN_CHECK(journal_.Append(FaultEntry{words::kLight, off.error().what, off.error().mend,
                                            off.error().where, off.error().kind, "", words::kOff}));
    }
  }
  EndEntry end;
  if (step == Step::cancelled) end = {EndResult::stopped, "cancelled"};
  if (step == Step::faulted) end = {EndResult::failed, ToString(*report_.fault)};
  if (step == Step::done && report_.views_accepted < report_.view_count)
    end = {EndResult::incomplete,
           fmt::format("{} of {} views have no frame", report_.view_count - report_.views_accepted,
                       report_.view_count)};
  SCAN_CHECK(journal_.Append(std::move(end)));
  Notify(CaptureState::ending, "ended");
  return step;
}

Result<CaptureRun::Step> CaptureRun::Checkpoint() {
  if (control_.paused() && !control_.cancelled()) {
    SCAN_CHECK(journal_.Append(PauseEntry{"asked for"}));
    const CaptureState before = progress_.state;
    Notify(CaptureState::paused, "paused");
    control_.WaitWhilePaused();
    if (!control_.cancelled()) {
      SCAN_CHECK(journal_.Append(ResumeEntry{words::kAfterPause}));
      Notify(before, "goes on");
    }
  }
  return control_.cancelled() ? Step::cancelled : Step::done;
}

Result<CaptureRun::Step> CaptureRun::Insist(const char* device, const char* call,
                                            const std::function<Status()>& once) {
  for (int attempt = 1;; ++attempt) {
    SCAN_TRY(const Step go, Checkpoint());
    if (go != Step::done) return go;
    const Status answer = once();
    if (answer) return Step::done;
    SCAN_TRY(const Step logged, LogDeviceError(device, call, "", answer.error()));
    if (logged != Step::done) return logged;
    if (attempt >= options_.max_attempts || !MayHelpToRepeat(answer.error()))
      return End(answer.error());
    SCAN_CHECK(LogRetry(nullptr, attempt + 1, answer.error().what));
  }
}

Result<CaptureRun::Step> CaptureRun::LogDeviceError(const std::string& device, const char* call,
                                                    const std::string& view, const Error& error) {
  if (error.kind == ErrorKind::cancelled) return Step::cancelled;
  SCAN_CHECK(journal_.Append(
      FaultEntry{device, error.what, error.mend, error.where, error.kind, view, call}));
  Notify(progress_.state, ToString(error));
  return Step::done;
}

Status CaptureRun::LogRetry(const Shot* shot, int attempt, const std::string& why) {
  RetryEntry entry;
  if (shot) {
    entry.view = shot->LoggedView();
    entry.camera = shot->view.camera;
  }
  entry.attempt = attempt;
  entry.reason = why;
  return journal_.Append(std::move(entry));
}

Result<CaptureRun::Step> CaptureRun::FailView(const Shot& shot, const std::string& why) {
  Error error{ErrorKind::device, shot.Name() + " failed: " + why, shot.view.camera,
              "mend the cause and resume the session"};
  FaultEntry entry;
  entry.device = words::kView;
  entry.what = error.what;
  entry.mend = error.mend;
  entry.where = error.where;
  entry.view = shot.LoggedView();
  SCAN_CHECK(journal_.Append(std::move(entry)));
  if (!shot.plate) {
    report_.failed.push_back({shot.view.id, why});
    ++progress_.views_failed;
  }
  if (options_.on_failed_view == OnFailedView::end) report_.fault = std::move(error);
  Notify(progress_.state, shot.Name() + " failed: " + why);
  return Step::view_failed;
}

CaptureRun::Step CaptureRun::End(const Error& fault) {
  report_.fault = fault;
  return Step::faulted;
}

void CaptureRun::Notify(CaptureState state, std::string message) {
  progress_.state = state;
  progress_.views_accepted = report_.views_accepted;
  progress_.view_count = report_.view_count;
  progress_.message = std::move(message);
  if (observer_) observer_->OnProgress(progress_);
}

const CameraDocument& CaptureRun::CameraOf(const PlannedView& view) const {
  const auto& cameras = journal_.state().cameras();
  return *std::find_if(cameras.begin(), cameras.end(),
                       [&](const CameraDocument& camera) { return camera.id == view.camera; });
}

}  // namespace scan
