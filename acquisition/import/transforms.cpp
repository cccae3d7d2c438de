#include <fmt/format.h>

#include <Eigen/SVD>
#include <array>
#include <cmath>

#include "acquisition/import/sources.h"
#include "acquisition/session/document_json.h"
#include "acquisition/session/json_fields.h"
#include "acquisition/session/picture_header.h"
#include "drivers/base/files.h"
#include "drivers/base/units.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

constexpr double kRigidTolerance = 1e-3;

// The first place where the file is. A path without extension may mean a picture of any kind.
Result<fs::path> FindFile(const JsonObject& object, std::string_view key, const fs::path& base,
                          const fs::path& photos) {
  SCAN_TRY(const std::string text, object.Text(key));
  std::vector<fs::path> places = {base / text};
  if (!photos.empty()) places.push_back(photos / fs::path(text).filename());
  std::error_code code;
  for (const auto& place : places)
    for (const char* extension : {"", ".png", ".jpg"})
      if (const fs::path path = place.string() + extension; fs::is_regular_file(path, code))
        return path.lexically_normal();
  return object.Wrong(key, "no such file '" + text + "'",
                      "paths count from the transforms file; copy the file there");
}

// Camera-to-table in OpenGL axes to camera_from_table in OpenCV axes.
Result<CameraFromTable> PoseFrom(const JsonObject& frame) {
  const std::string_view key = "transform_matrix";
  auto square = frame.Matrix(key, 4, 4);
  SCAN_TRY(const Eigen::MatrixXd rows, square ? square : frame.Matrix(key, 3, 4));
  Eigen::Matrix3d table_from_camera = rows.topLeftCorner<3, 3>();
  table_from_camera.rightCols<2>() *= -1;  // y up to y down, z backward to z forward
  const double off =
      (table_from_camera.transpose() * table_from_camera - Eigen::Matrix3d::Identity()).norm();
  if (!(off < kRigidTolerance) || table_from_camera.determinant() < 0)
    return frame.Wrong(key, "not a rigid transform",
                       "give camera-to-table with a rotation and mm, without scale");
  // The nearest rotation: files carry single precision.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(table_from_camera,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  const Eigen::Vector3d centre = rows.topRightCorner<3, 1>();
  return CameraFromTable(rotation.transpose(), -(rotation.transpose() * centre));
}

// A number of the frame, else of the whole file, else `absent`.
Result<double> Inherited(const JsonObject& root, const JsonObject& frame, std::string_view key,
                         double absent) {
  SCAN_TRY(const double of_file, root.Number(key, absent));
  return frame.Number(key, of_file);
}

Result<double> FocalLength(const JsonObject& root, const JsonObject& frame, int w) {
  SCAN_TRY(const double fl_x, Inherited(root, frame, "fl_x", 0));
  if (fl_x != 0) return fl_x;
  SCAN_TRY(const double angle, Inherited(root, frame, "camera_angle_x", 0));
  if (angle > 0 && angle < kPi) return 0.5 * w / std::tan(0.5 * angle);
  return root.Wrong("fl_x", "missing focal length", "give fl_x in pixels or camera_angle_x in rad");
}

Result<Intrinsics> IntrinsicsFrom(const JsonObject& root, const JsonObject& frame,
                                  const fs::path& picture) {
  SCAN_TRY(const PictureHeader header, ReadPictureHeader(picture));
  SCAN_TRY(const double w, Inherited(root, frame, "w", header.w));
  SCAN_TRY(const double h, Inherited(root, frame, "h", header.h));
  if (w != header.w || h != header.h)
    return frame.Wrong("file_path",
                       fmt::format("the picture has {} x {} pixels where w and h say {} x {}",
                                   header.w, header.h, w, h),
                       "give the size of the stored pixels, or the right picture");
  Intrinsics in;
  in.w = header.w;
  in.h = header.h;
  SCAN_TRY(in.fl_x, FocalLength(root, frame, in.w));
  SCAN_TRY(in.fl_y, Inherited(root, frame, "fl_y", in.fl_x));
  SCAN_TRY(in.cx, Inherited(root, frame, "cx", 0.5 * in.w));
  SCAN_TRY(in.cy, Inherited(root, frame, "cy", 0.5 * in.h));
  SCAN_TRY(in.k1, Inherited(root, frame, "k1", 0));
  SCAN_TRY(in.k2, Inherited(root, frame, "k2", 0));
  SCAN_TRY(in.k3, Inherited(root, frame, "k3", 0));
  SCAN_TRY(in.p1, Inherited(root, frame, "p1", 0));
  SCAN_TRY(in.p2, Inherited(root, frame, "p2", 0));
  SCAN_TRY(const double k4, Inherited(root, frame, "k4", 0));
  if (k4 != 0) return frame.Wrong("k4", "distortion k4 is not known here", "use k1 k2 p1 p2 k3");
  if (!(in.fl_x > 0) || !(in.fl_y > 0))
    return frame.Wrong("fl_x", "the focal length is not positive", "give it in pixels");
  return in;
}

Status ReadSigmas(const JsonObject& object, ImportedPhoto& photo) {
  SCAN_TRY(const auto intrinsics, object.OptionalObject("intrinsics_sigma"));
  if (intrinsics) {
    SCAN_TRY(photo.sigma.fl_rel, intrinsics->Number("fl_rel", photo.sigma.fl_rel));
    SCAN_TRY(photo.sigma.c_px, intrinsics->Number("c_px", photo.sigma.c_px));
    if (photo.sigma.fl_rel < 0 || photo.sigma.c_px < 0)
      return intrinsics->Wrong("", "a negative sigma", "give 0 or more");
  }
  SCAN_TRY(const auto prior, object.OptionalObject("prior_sigma"));
  if (prior) {
    SCAN_TRY(photo.prior_sigma, PriorSigmaFrom(*prior));
  }
  SCAN_TRY(const auto view, object.OptionalObject("prior_sigma_view"));
  if (view) {
    SCAN_TRY(photo.prior_sigma_view, PriorSigmaFrom(*view));
  }
  SCAN_TRY(const auto axes, object.OptionalObject("axes_sigma"));
  if (axes) {
    SCAN_TRY(photo.turntable_sigma_deg, axes->Number("turntable_deg", 0));
    SCAN_TRY(photo.lift_sigma_mm, axes->Number("lift_mm", 0));
    if (photo.turntable_sigma_deg < 0 || photo.lift_sigma_mm < 0)
      return axes->Wrong("", "a negative sigma", "give 0 or more");
  }
  return {};
}

Result<ImportedPhoto> PhotoFrom(const JsonObject& root, const JsonObject& frame,
                                const fs::path& base, const fs::path& photos) {
  ImportedPhoto photo;
  SCAN_TRY(photo.path, FindFile(frame, "file_path", base, photos));
  if (frame.Has("mask_path")) {
    SCAN_TRY(photo.mask, FindFile(frame, "mask_path", base, {}));
  }
  if (frame.Has("ignore_path")) {
    SCAN_TRY(photo.ignore, FindFile(frame, "ignore_path", base, {}));
  }
  SCAN_TRY(photo.intrinsics, IntrinsicsFrom(root, frame, photo.path));
  SCAN_CHECK(ReadSigmas(root, photo));
  SCAN_CHECK(ReadSigmas(frame, photo));
  if (frame.Has("transform_matrix")) {
    SCAN_TRY(photo.camera_from_table, PoseFrom(frame));
  }
  SCAN_TRY(photo.turntable_deg, frame.OptionalNumber("turntable_deg"));
  SCAN_TRY(photo.lift_mm, frame.OptionalNumber("lift_mm"));
  SCAN_TRY(photo.aim_id, frame.Id("aim_id", "a0"));
  SCAN_TRY(photo.mounting_id, frame.Id("mounting_id", "m0"));
  SCAN_TRY(photo.reference_epoch, frame.Int("reference_epoch", 0, 1 << 30, 1));
  return photo;
}

Status CheckCameraModel(const JsonObject& object) {
  SCAN_TRY(const std::string model, object.Text("camera_model", "OPENCV"));
  constexpr std::array<std::string_view, 5> kKnown = {"OPENCV", "PINHOLE", "SIMPLE_PINHOLE",
                                                      "SIMPLE_RADIAL", "RADIAL"};
  for (const auto known : kKnown)
    if (known == model) return {};
  return object.Wrong("camera_model", "camera model '" + model + "' is not known here",
                      "undistort the photographs to OPENCV or PINHOLE first");
}

}  // namespace

Result<ImportedSet> PhotosFromTransforms(const fs::path& file, const fs::path& photos) {
  SCAN_TRY(const std::string text, ReadTextFile(file));
  SCAN_TRY(const nlohmann::json json, ParseJson(text, file.string()));
  SCAN_TRY(const JsonObject root, JsonObject::Root(json, file.string()));
  SCAN_CHECK(CheckCameraModel(root));
  ImportedSet set;
  SCAN_TRY(set.approx_distance_mm, root.OptionalNumber("approx_distance_mm"));
  if (set.approx_distance_mm && !(*set.approx_distance_mm > 0))
    return root.Wrong("approx_distance_mm", "not positive", "give mm");
  SCAN_TRY(const auto frames, root.Objects("frames"));
  if (frames.empty()) return root.Wrong("frames", "no photograph", "list at least one");
  const fs::path base = fs::absolute(file).parent_path();
  for (const auto& frame : frames) {
    SCAN_CHECK(CheckCameraModel(frame));
    SCAN_TRY(ImportedPhoto photo, PhotoFrom(root, frame, base, photos));
    set.photos.push_back(std::move(photo));
  }
  return set;
}

}  // namespace scan
