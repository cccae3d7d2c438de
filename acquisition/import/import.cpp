#include "acquisition/import/import.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "acquisition/import/sources.h"
#include "acquisition/session/json_fields.h"
#include "acquisition/session/photo_set.h"
#include "acquisition/session/picture_header.h"
#include "acquisition/session/session_paths.h"
#include "acquisition/session/session_writer.h"
#include "drivers/base/files.h"
#include "drivers/base/units.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

constexpr PriorSigma kDefaultPriorSigma = {1, 10};  // of a pose that comes without

// Decodes without applying EXIF rotation; empty where it cannot.
cv::Mat Decode(const std::vector<std::byte>& bytes, int flags) {
  try {
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8U,
                         const_cast<std::byte*>(bytes.data()));
    return cv::imdecode(buffer, flags);
  } catch (const std::exception&) {  // cv::Exception, or no memory for what the header claims
    return {};
  }
}

Result<ImportedSet> ReadSource(const ImportRequest& request) {
  if (!request.transforms.empty() && !request.colmap.empty())
    return BadInput("both --transforms and --colmap", request.colmap.string(), "give one of them");
  if (!request.transforms.empty()) return PhotosFromTransforms(request.transforms, request.photos);
  if (request.photos.empty()) return BadInput("no photographs", "--photos", "name their folder");
  if (!request.colmap.empty()) return PhotosFromColmap(request.colmap, request.photos);
  return PhotosAlone(request.photos, request.sensor_width_mm);
}

// The picture in `folder` with the base name of `photo`; empty when there is none.
fs::path SameName(const fs::path& folder, const fs::path& photo) {
  std::error_code code;
  for (const char* extension : {".png", ".PNG", ".tif", ".tiff", ".jpg", ".jpeg", ".JPG"})
    if (const fs::path path = folder / (photo.stem().string() + extension);
        fs::is_regular_file(path, code))
      return path;
  return {};
}

Status AddMasks(const ImportRequest& request, std::vector<ImportedPhoto>& photos) {
  bool any_ignore = false;
  for (auto& photo : photos) {
    if (!request.masks.empty()) {
      photo.mask = SameName(request.masks, photo.path);
      if (photo.mask.empty())
        return BadInput("no mask for '" + photo.path.filename().string() + "'",
                        request.masks.string(), "give it a mask of the same base name");
    }
    if (request.ignore.empty()) continue;
    if (const fs::path ignore = SameName(request.ignore, photo.path); !ignore.empty())
      photo.ignore = ignore;
    any_ignore = any_ignore || !photo.ignore.empty();
  }
  if (!request.ignore.empty() && !any_ignore)
    return BadInput("no picture has the base name of a photograph", request.ignore.string(),
                    "name the pictures as the photographs");
  return {};
}

// The camera of each photograph (those with the same lens share one) and its view.
class Plan {
 public:
  Status Add(const ImportedPhoto& photo) {
    PlannedView view;
    view.name = photo.path.stem().string();
    view.id = MakeId(view.name);
    view.camera = fmt::format("c{}", CameraOf(photo));
    view.turntable_deg = photo.turntable_deg.value_or(0);
    view.lift_mm = photo.lift_mm.value_or(0);
    view.mounting_id = photo.mounting_id;
    view.aim_id = photo.aim_id;
    if (const auto [at, added] = names_.emplace(view.id, photo.path); !added)
      return BadInput("two photographs would be view '" + view.id + "'",
                      at->second.string() + " and " + photo.path.string(), "rename one of them");
    CameraDocument& camera = cameras[CameraOf(photo)];
    camera.camera_from_lift.try_emplace(photo.aim_id);
    SCAN_CHECK(TakeSigma(photo, camera));
    views.push_back(view);
    photos_of_aim_[{view.camera, view.aim_id}].push_back(&photo);
    return {};
  }

  // An aim has a nominal camera_from_lift where the logged axes explain all its poses.
  void FindAims(const Eigen::Vector3d& lift_direction) {
    for (auto& camera : cameras)
      for (auto& [aim, pose] : camera.camera_from_lift)
        pose = CommonPose(photos_of_aim_[{camera.id, aim}], lift_direction);
  }

  std::vector<CameraDocument> cameras;
  std::vector<PlannedView> views;

 private:
  std::size_t CameraOf(const ImportedPhoto& photo) {
    const auto same = [&](const CameraDocument& camera) {
      return camera.intrinsics == photo.intrinsics && camera.sigma.fl_rel == photo.sigma.fl_rel &&
             camera.sigma.c_px == photo.sigma.c_px;
    };
    const auto found = std::find_if(cameras.begin(), cameras.end(), same);
    if (found != cameras.end()) return static_cast<std::size_t>(found - cameras.begin());
    CameraDocument camera;
    camera.id = fmt::format("c{}", cameras.size());
    camera.intrinsics = photo.intrinsics;
    camera.sigma = photo.sigma;
    camera.camera_from_lift_sigma = kDefaultPriorSigma;
    cameras.push_back(std::move(camera));
    return cameras.size() - 1;
  }

  // prior_sigma is common to an aim: its photographs must agree.
  Status TakeSigma(const ImportedPhoto& photo, CameraDocument& camera) {
    if (!photo.camera_from_table) return {};
    const PriorSigma sigma = photo.prior_sigma.value_or(kDefaultPriorSigma);
    const auto [at, added] = camera.camera_from_lift_sigma_by_aim.try_emplace(photo.aim_id, sigma);
    if (!added && at->second != sigma)
      return BadInput("prior_sigma differs within aim '" + photo.aim_id + "'", photo.path.string(),
                      "give all frames of an aim one prior_sigma, or the frames aims of their own");
    return {};
  }

  static std::optional<CameraFromLift> CommonPose(const std::vector<const ImportedPhoto*>& photos,
                                                  const Eigen::Vector3d& lift_direction) {
    std::optional<CameraFromLift> common;
    for (const auto* photo : photos) {
      if (!photo->camera_from_table) continue;
      if (!photo->turntable_deg) return std::nullopt;
      const CameraFromLift pose =
          *photo->camera_from_table *
          MakeStationFromTable(RadFromDeg(*photo->turntable_deg)).inverse() *
          MakeLiftFromStation(photo->lift_mm.value_or(0), lift_direction).inverse();
      if (!common) common = pose;
      const bool agrees = (pose.rotation() - common->rotation()).norm() < 1e-6 &&
                          (pose.translation() - common->translation()).norm() < 1e-3;
      if (!agrees) return std::nullopt;
    }
    return common;
  }

  std::map<std::string, fs::path> names_;  // by view id
  std::map<std::pair<std::string, std::string>, std::vector<const ImportedPhoto*>> photos_of_aim_;
};

// One sigma for all aims of a camera is written once.
void Simplify(CameraDocument& camera) {
  auto& by_aim = camera.camera_from_lift_sigma_by_aim;
  if (by_aim.empty()) return;
  camera.camera_from_lift_sigma = by_aim.begin()->second;
  std::erase_if(by_aim,
                [&](const auto& entry) { return entry.second == camera.camera_from_lift_sigma; });
}

std::string SessionId(const fs::path& out) {
  const std::string id = MakeId(out.filename().string());
  return id.empty() ? "import" : id;
}

Result<SessionDocument> MakeDocument(const ImportRequest& request, const ImportedSet& set,
                                     const fs::path& out) {
  SessionDocument document;
  document.id = SessionId(out);
  document.created_utc_ns = request.now.utc_ns;
  document.software.version = request.software_version;
  document.station.lift.kind = LiftKind::manual_aim;
  document.approx_distance_mm =
      request.approx_distance_mm ? request.approx_distance_mm : set.approx_distance_mm;
  Plan plan;
  for (const auto& photo : set.photos) SCAN_CHECK(plan.Add(photo));
  plan.FindAims(document.station.lift.direction_in_station);
  for (auto& camera : plan.cameras) Simplify(camera);
  document.station.cameras = std::move(plan.cameras);
  document.views = std::move(plan.views);
  return document;
}

FrameEntry MakeFrame(const ImportedPhoto& photo, const PlannedView& view) {
  FrameEntry frame;
  frame.view = view.id;
  frame.camera = view.camera;
  frame.reference_epoch = photo.reference_epoch;
  if (photo.turntable_deg) {
    const double deg = *photo.turntable_deg;
    frame.axes.turntable_deg = AxisReading{deg, deg, deg, 0, photo.turntable_sigma_deg};
  }
  if (photo.lift_mm) {
    const double mm = *photo.lift_mm;
    frame.axes.lift_mm = AxisReading{mm, mm, mm, 0, photo.lift_sigma_mm};
  }
  frame.camera_from_table = photo.camera_from_table;
  frame.prior_sigma_view = photo.prior_sigma_view;
  return frame;
}

Result<std::vector<std::byte>> ReadPhoto(const ImportedPhoto& photo) {
  const std::string where = photo.path.string();
  if (PlainExtension(photo.path).empty())
    return BadInput("not a JPEG, PNG or TIFF photograph", where, "develop or convert it first");
  SCAN_TRY(auto bytes, ReadBinaryFile(photo.path));
  SCAN_CHECK(ReadPictureHeader(bytes, where));
  const cv::Mat picture = Decode(bytes, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  if (picture.cols != photo.intrinsics.w || picture.rows != photo.intrinsics.h)
    return BadInput("the picture cannot be decoded", where, "copy it again");
  return bytes;
}

// 8-bit grey PNG as it is; other 8-bit pictures become one.
Result<std::vector<std::byte>> ReadMask(const fs::path& path, const Intrinsics& size) {
  SCAN_TRY(auto bytes, ReadBinaryFile(path));
  SCAN_CHECK(ReadPictureHeader(bytes, path.string()));
  cv::Mat mask = Decode(bytes, cv::IMREAD_UNCHANGED);
  if (mask.empty() || mask.depth() != CV_8U)
    return BadInput("not a readable 8-bit picture", path.string(), "write the mask as 8-bit PNG");
  if (mask.cols != size.w || mask.rows != size.h)
    return BadInput(fmt::format("the mask has {} x {} pixels where its photograph has {} x {}",
                                mask.cols, mask.rows, size.w, size.h),
                    path.string(), "give a mask of the same size");
  if (mask.channels() == 1 && PlainExtension(path) == "png") return bytes;
  if (mask.channels() == 3) cv::cvtColor(mask, mask, cv::COLOR_BGR2GRAY);
  if (mask.channels() == 4) cv::cvtColor(mask, mask, cv::COLOR_BGRA2GRAY);
  std::vector<unsigned char> encoded;
  cv::imencode(".png", mask, encoded);
  const auto view = std::as_bytes(std::span(encoded));
  return std::vector<std::byte>(view.begin(), view.end());
}

Status CopyMask(const fs::path& source, const fs::path& target, const Intrinsics& size) {
  if (source.empty()) return {};
  SCAN_TRY(const auto bytes, ReadMask(source, size));
  std::error_code code;
  fs::create_directories(target.parent_path(), code);
  return WriteFileDurably(target, bytes);
}

Status WriteImported(const ImportRequest& request, const ImportedSet& set,
                     const SessionDocument& document, const fs::path& folder,
                     const ProgressFn& progress, const std::stop_token& stop) {
  SCAN_TRY(SessionWriter writer, CreateSession(folder, document, request.now));
  for (std::size_t i = 0; i < set.photos.size(); ++i) {
    if (stop.stop_requested()) return Cancelled("import");
    Report(progress, "import", static_cast<double>(i) / static_cast<double>(set.photos.size()));
    const ImportedPhoto& source = set.photos[i];
    SCAN_TRY(auto bytes, ReadPhoto(source));
    const std::vector<EncodedFile> pictures = {{PlainExtension(source.path), std::move(bytes)}};
    SCAN_CHECK(writer.AppendFrame(MakeFrame(source, document.views[i]), pictures, request.now));
    Photo photo;
    photo.path = writer.state().Frame(document.views[i].id, 0)->files.front().path;
    SCAN_CHECK(CopyMask(source.mask, MaskPath(folder, photo), source.intrinsics));
    SCAN_CHECK(CopyMask(source.ignore, IgnorePath(folder, photo), source.intrinsics));
  }
  SCAN_CHECK(writer.Append(EndEntry{EndResult::complete, "imported"}, request.now));
  Report(progress, "import", 1);
  return {};
}

// What --force may replace: a session, or an empty folder; never another thing.
Status CheckOutput(const fs::path& out, bool force) {
  std::error_code code;
  if (!fs::exists(fs::symlink_status(out, code))) return {};
  if (fs::is_directory(out, code) && fs::is_empty(out, code)) return {};
  if (!force)
    return BadInput("the output exists", out.string(), "name another --out or add --force");
  if (!fs::is_regular_file(out / kSessionFile, code))
    return BadInput("the output exists and is no session", out.string(), "name another --out");
  return {};
}

Status MoveInPlace(const fs::path& beside, const fs::path& out) {
  const fs::path old = out.parent_path() / ("." + out.filename().string() + ".old");
  std::error_code code, ignored;
  const bool replaces = fs::exists(out, code);
  if (replaces) {
    fs::remove_all(old, ignored);
    fs::rename(out, old, code);
  }
  if (!code) fs::rename(beside, out, code);
  if (code)
    return Failed("cannot move the session in place (" + code.message() + ")", out.string(),
                  "check the folder and its rights");
  if (replaces) fs::remove_all(old, ignored);
  return {};
}

}  // namespace

Result<ImportReport> ImportPhotographs(const ImportRequest& request, const ProgressFn& progress,
                                       std::stop_token stop) {
  fs::path out = fs::absolute(request.out).lexically_normal();
  if (!out.has_filename()) out = out.parent_path();
  if (request.out.empty() || !out.has_filename())
    return BadInput("no output", "--out", "name the session folder to be made");
  SCAN_CHECK(CheckOutput(out, request.force));
  SCAN_TRY(ImportedSet set, ReadSource(request));
  SCAN_CHECK(AddMasks(request, set.photos));
  SCAN_TRY(const SessionDocument document, MakeDocument(request, set, out));

  std::error_code code;
  const fs::path beside = out.parent_path() / ("." + out.filename().string() + ".part");
  fs::remove_all(beside, code);
  fs::create_directories(out.parent_path(), code);
  Status done = WriteImported(request, set, document, beside, progress, stop);
  if (done) done = MoveInPlace(beside, out);
  if (!done) {
    fs::remove_all(beside, code);
    return tl::unexpected<Error>(done.error());
  }
  ImportReport report;
  report.session = out;
  report.photographs = static_cast<int>(set.photos.size());
  report.cameras = static_cast<int>(document.station.cameras.size());
  for (const auto& photo : set.photos) {
    report.with_pose += photo.camera_from_table.has_value();
    report.with_mask += !photo.mask.empty();
  }
  return report;
}

}  // namespace scan
