#include "acquisition/session/session_state.h"

#include <fmt/format.h>

#include <algorithm>

#include "acquisition/session/json_fields.h"

namespace scan {
namespace {

constexpr const char* kRestore = "restore the session from its archive";

}  // namespace

SessionState::SessionState(SessionDocument document) : document_(std::move(document)) {
  for (std::size_t i = 0; i < document_.views.size(); ++i) view_index_[document_.views[i].id] = i;
}

const PlannedView* SessionState::FindView(const std::string& id) const {
  const auto found = view_index_.find(id);
  return found == view_index_.end() ? nullptr : &document_.views[found->second];
}

const CameraDocument* SessionState::FindCamera(const std::string& id) const {
  const auto found = std::find_if(cameras().begin(), cameras().end(),
                                  [&](const auto& camera) { return camera.id == id; });
  return found == cameras().end() ? nullptr : &*found;
}

const FrameEntry* SessionState::Frame(const std::string& view, int slice) const {
  const auto found = frames_.find({view, slice});
  return found == frames_.end() ? nullptr : &found->second.frame;
}

std::int64_t SessionState::FrameSeq(const std::string& view, int slice) const {
  const auto found = frames_.find({view, slice});
  return found == frames_.end() ? -1 : found->second.seq;
}

bool SessionState::Complete(const PlannedView& view) const {
  for (int slice = 0; slice < view.slices; ++slice)
    if (!frames_.contains({view.id, slice})) return false;
  return true;
}

Status SessionState::CheckFiles(const std::vector<FileDocument>& files,
                                const std::string& where) const {
  std::set<std::string> own;
  for (const auto& file : files)
    if (paths_.contains(file.path) || !own.insert(file.path).second)
      return BadInput("'" + file.path + "' is named twice", where, kRestore);
  if (files.empty()) return BadInput("no file", where, "name at least one picture");
  return {};
}

Status SessionState::CheckFrame(const FrameEntry& frame, const std::string& where) const {
  const PlannedView* view = FindView(frame.view);
  if (!view) return BadInput("unknown view '" + frame.view + "'", where, "name a view of the plan");
  if (view->camera != frame.camera)
    return BadInput("view '" + frame.view + "' belongs to camera '" + view->camera + "', not '" +
                        frame.camera + "'",
                    where, "name the camera of the plan");
  if (frame.slice < 0 || frame.slice >= view->slices)
    return BadInput(fmt::format("view '{}' has no slice {}", frame.view, frame.slice), where,
                    fmt::format("count slices from 0 to {}", view->slices - 1));
  if (Frame(frame.view, frame.slice))
    return BadInput(fmt::format("view '{}' slice {} has a frame already", frame.view, frame.slice),
                    where, "log a retake before the new frame");
  return CheckFiles(frame.files, where);
}

Status SessionState::CheckPlan(const PlanExtendEntry& extension, const std::string& where) const {
  std::set<std::string> own;
  for (std::size_t i = 0; i < extension.views.size(); ++i) {
    const PlannedView& view = extension.views[i];
    const std::string field = fmt::format("{}: views[{}]", where, i);
    SCAN_CHECK(ValidatePlannedView(view, cameras(), field));
    if (FindView(view.id) || !own.insert(view.id).second)
      return BadInput("view '" + view.id + "' stands twice", field + ".id",
                      "give each view its own id");
  }
  return {};
}

Status SessionState::Check(const LogEntry& entry, const std::string& where) const {
  if (entry.seq != next_seq_)
    return BadInput(fmt::format("seq {} where {} was due", entry.seq, next_seq_), where, kRestore);
  if (std::holds_alternative<StartEntry>(entry.payload) != (next_seq_ == 0))
    return BadInput("the first document, and only that, is of type start", where, kRestore);
  if (const auto* frame = std::get_if<FrameEntry>(&entry.payload)) return CheckFrame(*frame, where);
  if (const auto* extension = std::get_if<PlanExtendEntry>(&entry.payload))
    return CheckPlan(*extension, where);
  if (const auto* retake = std::get_if<RetakeEntry>(&entry.payload)) {
    const std::int64_t seq = FrameSeq(retake->view, retake->slice);
    if (seq < 0 || seq != retake->replaces_seq)
      return BadInput(fmt::format("document {} is no frame of view '{}' that counts",
                                  retake->replaces_seq, retake->view),
                      where, "name the frame that is replaced");
  }
  if (const auto* reject = std::get_if<RejectEntry>(&entry.payload);
      reject && !reject->files.empty())
    return CheckFiles(reject->files, where);
  if (const auto* aim = std::get_if<AimEntry>(&entry.payload)) {
    if (!IsId(aim->aim_id) || !FindCamera(aim->camera))
      return BadInput("unknown camera '" + aim->camera + "' or no aim id", where,
                      "name a camera of the station and an aim id");
  }
  if (const auto* note = std::get_if<NoteEntry>(&entry.payload); note && note->plate) {
    const CameraDocument* camera = FindCamera(note->plate->camera);
    const std::string& aim = note->plate->aim_id;
    if (!camera || (!aim.empty() && !camera->camera_from_lift.contains(aim)))
      return BadInput("a plate of an unknown camera or aim", where, "name one of the station");
    return CheckFiles(note->plate->files, where);
  }
  return {};
}

void SessionState::AddAim(const AimEntry& aim) {
  for (auto& camera : document_.station.cameras) {
    if (camera.id != aim.camera) continue;
    auto& pose = camera.camera_from_lift[aim.aim_id];
    if (aim.camera_from_lift) pose = aim.camera_from_lift;
    if (aim.camera_from_lift_sigma)
      camera.camera_from_lift_sigma_by_aim[aim.aim_id] = *aim.camera_from_lift_sigma;
  }
}

Status SessionState::Apply(const LogEntry& entry, const std::string& where) {
  SCAN_CHECK(Check(entry, where));
  ++next_seq_;
  if (const auto* frame = std::get_if<FrameEntry>(&entry.payload)) {
    frames_[{frame->view, frame->slice}] = {entry.seq, *frame};
    for (const auto& file : frame->files) paths_.insert(file.path);
  } else if (const auto* retake = std::get_if<RetakeEntry>(&entry.payload)) {
    frames_.erase({retake->view, retake->slice});
  } else if (const auto* extension = std::get_if<PlanExtendEntry>(&entry.payload)) {
    for (const auto& view : extension->views) {
      view_index_[view.id] = document_.views.size();
      document_.views.push_back(view);
    }
  } else if (const auto* aim = std::get_if<AimEntry>(&entry.payload)) {
    AddAim(*aim);
  } else if (const auto* note = std::get_if<NoteEntry>(&entry.payload); note && note->plate) {
    plates_.push_back(*note->plate);
    for (const auto& file : note->plate->files) paths_.insert(file.path);
  } else if (const auto* reject = std::get_if<RejectEntry>(&entry.payload)) {
    for (const auto& file : reject->files) paths_.insert(file.path);
  }
  return {};
}

}  // namespace scan
