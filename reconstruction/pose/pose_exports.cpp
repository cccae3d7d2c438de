#include "reconstruction/pose/pose_exports.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "acquisition/session/json_fields.h"
#include "drivers/base/files.h"

namespace scan {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct ExportedView {
  const ViewPose* pose;
  const Photo* photo;
  const Intrinsics* intrinsics;
};

// The accepted views with what belongs to them, in the order of `poses`.
Result<std::vector<ExportedView>> AcceptedViews(const Poses& poses, const PhotoSet& photos) {
  std::vector<ExportedView> views;
  for (const auto& pose : poses.views) {
    if (pose.status != ViewStatus::accepted) continue;
    const auto photo = std::find_if(photos.photos.begin(), photos.photos.end(),
                                    [&](const Photo& entry) { return entry.name == pose.name; });
    if (photo == photos.photos.end())
      return BadInput("the session has no photograph '" + pose.name + "'", photos.session.string(),
                      "give the session that the poses were found for");
    const auto lens = poses.lens_states.find(pose.lens_state);
    if (lens == poses.lens_states.end())
      return BadInput(
          "view '" + pose.name + "' names the unknown lens state '" + pose.lens_state + "'",
          "poses", "find the poses again");
    views.push_back({&pose, &*photo, &lens->second.intrinsics});
  }
  return views;
}

void PutIntrinsics(const Intrinsics& in, Json& json) {
  json["fl_x"] = in.fl_x;
  json["fl_y"] = in.fl_y;
  json["cx"] = in.cx;
  json["cy"] = in.cy;
  json["w"] = in.w;
  json["h"] = in.h;
  json["k1"] = in.k1;
  json["k2"] = in.k2;
  json["k3"] = in.k3;
  json["p1"] = in.p1;
  json["p2"] = in.p2;
}

std::string Relative(const fs::path& path, const fs::path& folder) {
  return path.lexically_relative(fs::absolute(folder).lexically_normal()).generic_string();
}

// OpenCV camera axes to OpenGL's: y and z change sign.
Json OpenGlRows(const CameraFromModel& camera_from_model) {
  Eigen::Matrix4d model_from_camera = camera_from_model.inverse().isometry().matrix();
  model_from_camera.middleCols<2>(1) *= -1;
  return JsonRows(Eigen::MatrixXd(model_from_camera));
}

std::string CameraLine(std::size_t id, const Intrinsics& in) {
  const std::string pinhole =
      fmt::format("{} {} {} {} {} {}", in.w, in.h, in.fl_x, in.fl_y, in.cx, in.cy);
  if (!in.has_distortion()) return fmt::format("{} PINHOLE {}\n", id, pinhole);
  const std::string opencv = fmt::format("{} {} {} {} {}", pinhole, in.k1, in.k2, in.p1, in.p2);
  if (in.k3 == 0) return fmt::format("{} OPENCV {}\n", id, opencv);
  return fmt::format("{} FULL_OPENCV {} {} 0 0 0\n", id, opencv, in.k3);
}

}  // namespace

Status WriteTransforms(const fs::path& folder, const Poses& poses, const PhotoSet& photos) {
  SCAN_TRY(const auto views, AcceptedViews(poses, photos));
  Json json = {{"camera_model", "OPENCV"}};
  const bool one_lens =
      !views.empty() && std::all_of(views.begin(), views.end(), [&](const auto& view) {
        return view.intrinsics == views.front().intrinsics;
      });
  if (one_lens) PutIntrinsics(*views.front().intrinsics, json);
  json["frames"] = Json::array();
  for (const auto& view : views) {
    Json frame = {{"file_path", Relative(view.photo->path, folder)}};
    if (!view.photo->mask_path.empty())
      frame["mask_path"] = Relative(view.photo->mask_path, folder);
    if (!one_lens) PutIntrinsics(*view.intrinsics, frame);
    frame["transform_matrix"] = OpenGlRows(view.pose->camera_from_model);
    json["frames"].push_back(std::move(frame));
  }
  SCAN_TRY(const std::string text, DumpJson(json, 1, "transforms.json"));
  return WriteFileDurably(folder / "transforms.json", text + "\n");
}

Status WriteColmap(const fs::path& folder, const Poses& poses, const PhotoSet& photos) {
  SCAN_TRY(const auto views, AcceptedViews(poses, photos));
  std::string cameras = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n";
  std::map<const Intrinsics*, std::size_t> camera_ids;
  for (const auto& [id, lens] : poses.lens_states) {
    const std::size_t number = camera_ids.size() + 1;
    camera_ids[&lens.intrinsics] = number;
    cameras += CameraLine(number, lens.intrinsics);
  }
  std::string images =
      "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n# (no points: each second line is empty)\n";
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Eigen::Quaterniond q(views[i].pose->camera_from_model.rotation());
    const Eigen::Vector3d t = views[i].pose->camera_from_model.translation();
    images += fmt::format("{} {} {} {} {} {} {} {} {} {}\n\n", i + 1, q.w(), q.x(), q.y(), q.z(),
                          t.x(), t.y(), t.z(), camera_ids.at(views[i].intrinsics),
                          views[i].photo->path.filename().string());
  }
  const fs::path sparse = folder / "sparse" / "0";
  std::error_code code;
  fs::create_directories(sparse, code);
  if (code)
    return Failed("cannot create the folder (" + code.message() + ")", sparse.string(),
                  "check the path and its rights");
  SCAN_CHECK(WriteFileDurably(sparse / "cameras.txt", cameras));
  SCAN_CHECK(WriteFileDurably(sparse / "images.txt", images));
  return WriteFileDurably(sparse / "points3D.txt",
                          std::string_view("# POINT3D_ID X Y Z R G B ERROR TRACK[]\n"));
}

}  // namespace scan
