#include "acquisition/session/photo_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "acquisition/session/picture_header.h"
#include "acquisition/session/session_paths.h"
#include "acquisition/session/session_reader.h"
#include "drivers/base/units.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

constexpr double kDefaultPrincipalPointSigma = 0.003;  // of the width
constexpr double kDefaultFocalSigma = 0.01;            // of the focal length

RigidSigma ToRadians(const PriorSigma& sigma) {
  return {RadFromDeg(sigma.rotation_deg), sigma.translation_mm};
}

AxisPrior ToPrior(const AxisReading& axis, double unit) {
  return {unit * axis.estimated, unit * axis.sigma_shared, unit * axis.sigma_view};
}

IntrinsicsSigma Resolved(const CameraDocument& camera) {
  IntrinsicsSigma sigma = camera.sigma;
  if (sigma.fl_rel == 0) sigma.fl_rel = kDefaultFocalSigma;
  if (sigma.c_px == 0) sigma.c_px = kDefaultPrincipalPointSigma * camera.intrinsics.w;
  return sigma;
}

bool HasPlain(const std::vector<FileDocument>& files) {
  return std::any_of(files.begin(), files.end(), [](const auto& file) {
    return !IsRawExtension(fs::path(file.path).extension().string().substr(1));
  });
}

// Of RAW + JPEG the one that every decoder reads.
fs::path MainPicture(const fs::path& session, const std::vector<FileDocument>& files) {
  for (const auto& file : files)
    if (!HasPlain(files) || HasPlain({file})) return session / file.path;
  return session / files.front().path;
}

// Collects the parts of a photo set from a session.
class Assembler {
 public:
  explicit Assembler(const Session& session) : session_(session) {
    set_.session = session.folder;
    set_.lift_direction_in_station = session.document.station.lift.direction_in_station;
    set_.approx_distance_mm = session.document.approx_distance_mm;
    for (const auto& camera : session.state.cameras())
      for (const auto& [aim, pose] : camera.camera_from_lift) ++cameras_of_aim_[aim];
  }

  Status Add(const PlannedView& view) {
    if (!session_.state.Complete(view)) return {};
    const FrameEntry& frame = *session_.state.Frame(view.id, 0);
    SCAN_TRY(const int aim, AimOf(view));
    Photo photo;
    photo.id = view.id;
    photo.name = view.name.empty() ? view.id : view.name;
    SCAN_TRY(photo.path, PathOf(view, frame));
    SCAN_CHECK(CheckSize(photo.path, set_.lens_states[LensOf(aim)].intrinsics));
    photo.aim = aim;
    photo.mounting_id = view.mounting_id;
    photo.reference_epoch = frame.reference_epoch;
    photo.capture_seq = session_.state.FrameSeq(view.id, 0);
    if (frame.axes.turntable_deg)
      photo.turntable_rad = ToPrior(*frame.axes.turntable_deg, RadFromDeg(1));
    if (frame.axes.lift_mm) photo.lift_mm = ToPrior(*frame.axes.lift_mm, 1);
    photo.camera_from_table = NominalPose(frame, photo, set_.aims[static_cast<std::size_t>(aim)]);
    photo.sigma_view = ToRadians(frame.prior_sigma_view);
    std::error_code code;
    if (const fs::path mask = MaskPath(set_.session, photo); fs::exists(mask, code))
      photo.mask_path = mask;
    if (const fs::path ignore = IgnorePath(set_.session, photo); fs::exists(ignore, code))
      photo.ignore_path = ignore;
    set_.photos.push_back(std::move(photo));
    return {};
  }

  PhotoSet Take() { return std::move(set_); }

 private:
  std::size_t LensOf(int aim) const {
    return static_cast<std::size_t>(set_.aims[static_cast<std::size_t>(aim)].lens_state);
  }

  // The index of the view's aim, which is added with its lens state when it is new.
  Result<int> AimOf(const PlannedView& view) {
    const auto key = std::pair(view.camera, view.aim_id);
    if (const auto found = aim_index_.find(key); found != aim_index_.end()) return found->second;
    const auto& cameras = session_.state.cameras();
    const auto camera = std::find_if(cameras.begin(), cameras.end(),
                                     [&](const auto& entry) { return entry.id == view.camera; });
    Aim aim;
    aim.camera = view.camera;
    // An aim's name alone where one camera has it, so that results read as the session does.
    aim.id = cameras_of_aim_[view.aim_id] > 1 ? view.camera + "-" + view.aim_id : view.aim_id;
    aim.camera_from_lift = camera->camera_from_lift.at(view.aim_id);
    const auto own_sigma = camera->camera_from_lift_sigma_by_aim.find(view.aim_id);
    aim.sigma = ToRadians(own_sigma != camera->camera_from_lift_sigma_by_aim.end()
                              ? own_sigma->second
                              : camera->camera_from_lift_sigma);
    aim.background_plate = BackgroundPlate(view);
    SCAN_TRY(aim.lens_state, LensStateOf(*camera, view));
    set_.aims.push_back(std::move(aim));
    const int index = static_cast<int>(set_.aims.size()) - 1;
    aim_index_[key] = index;
    return index;
  }

  Result<int> LensStateOf(const CameraDocument& camera, const PlannedView& view) {
    const auto named = camera.lens_state.find(view.aim_id);
    const std::string id =
        named != camera.lens_state.end() ? named->second : view.camera + "-" + view.aim_id;
    for (std::size_t i = 0; i < set_.lens_states.size(); ++i) {
      if (set_.lens_states[i].id != id) continue;
      if (set_.lens_states[i].intrinsics != camera.intrinsics)
        return BadInput("lens state '" + id + "' is named by two different cameras",
                        (set_.session / kSessionFile).string() + ": station.cameras",
                        "give each camera lens states of its own");
      return static_cast<int>(i);
    }
    set_.lens_states.push_back({id, camera.intrinsics, Resolved(camera)});
    return static_cast<int>(set_.lens_states.size()) - 1;
  }

  // The last logged, or a file that lies in its place.
  fs::path BackgroundPlate(const PlannedView& view) const {
    const auto& plates = session_.state.plates();
    for (auto plate = plates.rbegin(); plate != plates.rend(); ++plate)
      if (plate->plate == PlateKind::background && plate->camera == view.camera &&
          plate->aim_id == view.aim_id)
        return MainPicture(set_.session, plate->files);
    std::error_code code;
    for (const char* extension : {"png", "tif", "jpg"}) {
      const fs::path path =
          set_.session / PlatePath(PlateKind::background, view.aim_id, view.camera, 0, extension);
      if (fs::exists(path, code)) return path;
    }
    return {};
  }

  // The frame's picture, or the stack of its slices.
  Result<fs::path> PathOf(const PlannedView& view, const FrameEntry& frame) const {
    if (view.slices == 1) return MainPicture(set_.session, frame.files);
    std::error_code code;
    for (const char* extension : {"png", "tif", "jpg"}) {
      const fs::path stack = set_.session / "derived" / "stacks" /
                             fmt::format("{}_{}.{}", view.id, view.camera, extension);
      if (fs::exists(stack, code)) return stack;
    }
    return BadInput("view '" + view.id + "' has slices that are not stacked",
                    (set_.session / "derived" / "stacks").string(), "stack them first");
  }

  static Status CheckSize(const fs::path& path, const Intrinsics& intrinsics) {
    if (IsRawExtension(path.extension().string().substr(1))) return {};
    SCAN_TRY(const PictureHeader header, ReadPictureHeader(path));
    if (header.w != intrinsics.w || header.h != intrinsics.h)
      return BadInput(fmt::format("the picture has {} x {} pixels where its camera says {} x {}",
                                  header.w, header.h, intrinsics.w, intrinsics.h),
                      path.string(), "restore the picture");
    return {};
  }

  // As logged, else from the aim and the axes.
  std::optional<CameraFromTable> NominalPose(const FrameEntry& frame, const Photo& photo,
                                             const Aim& aim) const {
    if (frame.camera_from_table) return frame.camera_from_table;
    if (!aim.camera_from_lift || !photo.turntable_rad) return std::nullopt;
    const double lift_mm = photo.lift_mm ? photo.lift_mm->nominal : 0;
    return *aim.camera_from_lift * MakeLiftFromStation(lift_mm, set_.lift_direction_in_station) *
           MakeStationFromTable(photo.turntable_rad->nominal);
  }

  const Session& session_;
  PhotoSet set_;
  std::map<std::string, int> cameras_of_aim_;
  std::map<std::pair<std::string, std::string>, int> aim_index_;  // by camera and aim id
};

}  // namespace

Result<PhotoSet> LoadPhotoSet(const fs::path& folder) {
  SCAN_TRY(const Session session, ReadSession(folder));
  Assembler assembler(session);
  for (const auto& view : session.state.views()) SCAN_CHECK(assembler.Add(view));
  PhotoSet set = assembler.Take();
  if (set.photos.empty())
    return BadInput("the session has no frame", session.folder.string(),
                    "capture at least one view");
  return set;
}

}  // namespace scan
