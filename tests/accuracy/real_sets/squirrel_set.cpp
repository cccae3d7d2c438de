#include "tests/accuracy/real_sets/squirrel_set.h"

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "drivers/base/files.h"
#include "drivers/base/units.h"
#include "reconstruction/mesh/mesh_io.h"

namespace scan::test {
namespace {

using nlohmann::json;

Eigen::Isometry3d IsometryOf(const json& rows) {
  Eigen::Isometry3d isometry = Eigen::Isometry3d::Identity();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) isometry.matrix()(r, c) = rows.at(r).at(c).get<double>();
  return isometry;
}

}  // namespace

std::optional<Squirrel> LoadSquirrel(const std::filesystem::path& folder) {
  const auto text = ReadTextFile(folder / "transforms.json");
  auto truth = ReadCalibrated(folder / "truth.json");
  auto mesh = ReadMesh(folder / "mesh_mm.ply");
  if (!text || !truth || !mesh) return std::nullopt;
  const json file = json::parse(*text);
  Squirrel squirrel;
  squirrel.truth = std::move(*truth);
  squirrel.mesh = std::move(*mesh);
  LensState lens;
  lens.id = "lens";
  lens.intrinsics = {file["w"], file["h"], file["fl_x"], file["fl_y"], file["cx"], file["cy"]};
  lens.sigma = {file["intrinsics_sigma"]["fl_rel"], file["intrinsics_sigma"]["c_px"]};
  squirrel.photos.lens_states.push_back(lens);
  Aim aim;
  aim.id = "a0";
  aim.camera = "c0";
  const json& first = file["frames"][0]["prior_sigma"];
  aim.sigma = {RadFromDeg(first["rotation_deg"]), first["translation_mm"]};
  squirrel.photos.aims.push_back(aim);
  squirrel.photos.approx_distance_mm = file["approx_distance_mm"].get<double>();
  Eigen::Matrix3d flip = Eigen::Vector3d(1, -1, -1).asDiagonal();  // OpenGL to OpenCV axes
  for (const json& frame : file["frames"]) {
    Photo photo;
    photo.name = photo.id = std::filesystem::path(frame["file_path"].get<std::string>()).stem();
    Eigen::Isometry3d table_from_camera = IsometryOf(frame["transform_matrix"]);
    table_from_camera.linear() = table_from_camera.linear() * flip;
    photo.camera_from_table = CameraFromTable(table_from_camera.inverse());
    photo.turntable_rad = AxisPrior{RadFromDeg(frame["turntable_deg"]), 0, 0};
    photo.sigma_view = {RadFromDeg(frame["prior_sigma_view"]["rotation_deg"]),
                        frame["prior_sigma_view"]["translation_mm"]};
    squirrel.photos.photos.push_back(photo);
    Mask mask;
    mask.coverage =
        cv::imread((folder / frame["mask_path"].get<std::string>()).string(), cv::IMREAD_GRAYSCALE);
    mask.binary = true;
    squirrel.masks.push_back(mask);
  }
  return squirrel;
}

void IgnoreBase(std::vector<Mask>& masks) {
  for (Mask& mask : masks) {
    cv::Mat points;
    cv::findNonZero(mask.coverage, points);
    const cv::Rect box = cv::boundingRect(points);
    mask.ignore = cv::Mat(mask.coverage.size(), CV_8U, cv::Scalar(0));
    const int top = box.y + static_cast<int>(0.88 * box.height);
    mask.ignore.rowRange(top, mask.ignore.rows).setTo(255);
  }
}

}  // namespace scan::test
