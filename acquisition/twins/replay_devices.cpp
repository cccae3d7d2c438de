#include "acquisition/twins/replay_devices.h"

#include <fmt/format.h>

#include "acquisition/runner/run_words.h"

namespace scan {
namespace {

namespace words = run_words;

template <class Entry>
const Entry* As(const LogEntry* entry) {
  return entry ? std::get_if<Entry>(&entry->payload) : nullptr;
}

// The fault that the recording holds for this call, or none.
std::optional<Error> FaultOf(const LogEntry* entry, const std::string& device, const char* call) {
  const auto* fault = As<FaultEntry>(entry);
  if (!fault || fault->device != device || fault->call != call) return std::nullopt;
  return Error{fault->kind, fault->what, fault->where, fault->mend};
}

// What one exposure gave, whether it counted or not.
struct Exposed {
  std::string view;  // empty: of a plate
  std::string camera;
  const std::vector<FileDocument>* files;
  std::uint64_t sensor_sequence;
  std::optional<ExposureBound> bound;
  AppliedSettings applied;
};

std::optional<Exposed> ExposureOf(const LogEntry* entry) {
  if (const auto* frame = As<FrameEntry>(entry))
    return Exposed{frame->view,     frame->camera, &frame->files, frame->sensor_sequence,
                   frame->exposure, frame->applied};
  if (const auto* reject = As<RejectEntry>(entry))
    return Exposed{reject->view,     reject->camera, &reject->files, reject->sensor_sequence,
                   reject->exposure, reject->applied};
  if (const auto* note = As<NoteEntry>(entry); note && note->plate)
    return Exposed{"",
                   note->plate->camera,
                   &note->plate->files,
                   note->plate->sensor_sequence,
                   note->plate->exposure,
                   note->plate->applied};
  return std::nullopt;
}

}  // namespace

Station MakeReplayStation(const std::shared_ptr<ReplayScript>& script) {
  Station station;
  station.clock = std::make_shared<ReplayClock>(script);
  station.motion = std::make_unique<ReplayMotion>(script);
  station.light = std::make_unique<ReplayLight>(script);
  for (const CameraDocument& camera : script->document().station.cameras)
    station.cameras[camera.id] = std::make_unique<ReplayCamera>(script, camera);
  return station;
}

Result<HomeReport> ReplayMotion::Home(std::stop_token stop) {
  if (stop.stop_requested()) return Cancelled("motion");
  const LogEntry* next = script_->Next();
  if (const auto fault = FaultOf(next, words::kMotion, words::kHome))
    return tl::unexpected<Error>(*fault);
  const auto* home = As<HomeEntry>(next);
  if (!home) return script_->Missing("homing");
  std::lock_guard lock(mutex_);
  status_.turntable = status_.lift = AxisState::idle;
  status_.reference_epoch = home->reference_epoch;
  status_.position = home->position;
  return HomeReport{home->reference_epoch, home->position};
}

Result<MoveReport> ReplayMotion::MoveTo(const StageTarget& target, std::stop_token stop) {
  if (stop.stop_requested()) return Cancelled("motion");
  const LogEntry* next = script_->Next();
  const auto* asked = As<MoveEntry>(script_->Last());
  const auto fault = FaultOf(next, words::kMotion, words::kMove);
  const auto* settle = As<SettleEntry>(next);
  if (!asked || asked->target != target || (!fault && !settle))
    return script_->Missing(fmt::format("move to {:g} deg, {:g} mm, aim {}", target.turntable_deg,
                                        target.lift_mm, target.aim_id));
  if (fault) return tl::unexpected<Error>(*fault);
  std::lock_guard lock(mutex_);
  status_.position = settle->position;
  return MoveReport{settle->position, settle->settled_mono_ns};
}

MotionStatus ReplayMotion::ReadStatus() {
  std::lock_guard lock(mutex_);
  return status_;
}

ReplayCamera::ReplayCamera(std::shared_ptr<ReplayScript> script, const CameraDocument& camera)
    : script_(std::move(script)),
      info_{camera.id, "replay", camera.intrinsics.w, camera.intrinsics.h} {}

Result<AppliedSettings> ReplayCamera::Configure(const CameraSettings& settings) {
  const LogEntry* next = script_->Next();
  if (const auto fault = FaultOf(next, info_.id, words::kConfigure))
    return tl::unexpected<Error>(*fault);
  asked_ = settings;
  if (FaultOf(next, info_.id, words::kGrab)) return AppliedSettings{};
  const auto exposed = ExposureOf(next);
  if (!exposed || exposed->camera != info_.id)
    return script_->Missing("exposure of camera " + info_.id);
  return exposed->applied;
}

Status ReplayCamera::CheckAsked(const std::string& view) const {
  for (const PlannedView& planned : script_->document().views)
    if (planned.id == view && planned.exposure_us != asked_.exposure_us.value_or(0))
      return script_->Missing(
          fmt::format("exposure of {:g} us of view {}", asked_.exposure_us.value_or(0), view));
  return {};
}

Result<Frame> ReplayCamera::Grab(std::stop_token stop) {
  if (stop.stop_requested()) return Cancelled("camera " + info_.id);
  const LogEntry* next = script_->Next();
  if (const auto fault = FaultOf(next, info_.id, words::kGrab))
    return tl::unexpected<Error>(*fault);
  const auto exposed = ExposureOf(next);
  if (!exposed || exposed->camera != info_.id || !exposed->bound)
    return script_->Missing("frame of camera " + info_.id);
  SCAN_CHECK(CheckAsked(exposed->view));
  Frame frame;
  SCAN_TRY(frame.files, script_->ReadPictures(*exposed->files));
  frame.sensor_sequence = exposed->sensor_sequence;
  frame.exposure = *exposed->bound;
  frame.applied = exposed->applied;
  return frame;
}

Status ReplayLight::Set(bool on) {
  if (const auto fault = FaultOf(script_->Next(), words::kLight, on ? words::kOn : words::kOff))
    return tl::unexpected<Error>(*fault);
  return {};
}

}  // namespace scan
