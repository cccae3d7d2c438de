// scanstation.poses/1. Angles rad, lengths mm, pixels full size; a figure that is not finite
// (infinite: unknown) is written null and read back infinite.
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "acquisition/session/json_fields.h"
#include "drivers/base/files.h"
#include "reconstruction/pose/poses.h"

namespace scan {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kSchema = "scanstation.poses/1";
constexpr std::string_view kStatusNames[] = {"accepted", "rejected"};
constexpr std::string_view kKindNames[] = {"rotation", "translation", "scale"};
constexpr std::string_view kScopeNames[] = {"mounting", "view", "shared"};
constexpr int kMaxPictureSide = 1 << 17;

template <class Enum, std::size_t N>
std::string_view Name(Enum value, const std::string_view (&names)[N]) {
  return names[static_cast<std::size_t>(value)];
}

Json Figure(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Result<double> FigureFrom(const JsonObject& object, std::string_view key) {
  return object.Number(key, std::numeric_limits<double>::infinity());
}

Json ToJson(const SharedEstimate& estimate) {
  return {{"value", estimate.value},
          {"sigma", Figure(estimate.sigma)},
          {"prior_sigma", Figure(estimate.prior_sigma)}};
}

Json ToJson(const std::map<std::string, SharedEstimate>& estimates) {
  Json json = Json::object();
  for (const auto& [name, estimate] : estimates) json[name] = ToJson(estimate);
  return json;
}

Json ToJson(const LensEstimate& lens) {
  const Intrinsics& in = lens.intrinsics;
  return {{"w", in.w},   {"h", in.h},   {"fl_x", in.fl_x}, {"fl_y", in.fl_y},
          {"cx", in.cx}, {"cy", in.cy}, {"k1", in.k1},     {"k2", in.k2},
          {"p1", in.p1}, {"p2", in.p2}, {"k3", in.k3},     {"parameters", ToJson(lens.parameters)}};
}

Json ToJson(const FreeDirection& direction) {
  return {{"kind", Name(direction.kind, kKindNames)},
          {"scope", Name(direction.scope, kScopeNames)},
          {"of", direction.of},
          {"axis", JsonVector(direction.axis)},
          {"point", JsonVector(direction.point)},
          {"data_sigma", Figure(direction.data_sigma)},
          {"held_by", direction.held_by}};
}

Json ToJson(const ViewPose& view) {
  Json alternatives = Json::array();
  for (const auto& alternative : view.alternatives)
    alternatives.push_back(
        {{"camera_from_model", JsonRows(alternative.camera_from_model.isometry())},
         {"log_likelihood_gap", Figure(alternative.log_likelihood_gap)}});
  return {{"name", view.name},
          {"status", Name(view.status, kStatusNames)},
          {"reason", view.reason},
          {"lens_state", view.lens_state},
          {"mounting", view.mounting},
          {"aim", view.aim},
          {"camera_from_model", JsonRows(view.camera_from_model.isometry())},
          {"cost_px", Figure(view.cost_px)},
          {"cost_l1_px", Figure(view.cost_l1_px)},
          {"contour_rms_px", Figure(view.contour_rms_px)},
          {"covariance", JsonRows(Eigen::MatrixXd(view.covariance))},
          {"surface_sigma_px",
           {{"median", Figure(view.surface_sigma_px.median)},
            {"p95", Figure(view.surface_sigma_px.p95)}}},
          {"alternatives", std::move(alternatives)}};
}

Json ToJson(const Poses& poses) {
  Json json = {{"schema", kSchema},
               {"method", poses.method},
               {"model", poses.model},
               {"units", {{"length", "mm"}, {"angle", "rad"}, {"pixel", "full size"}}}};
  json["intrinsics"] = Json::object();
  for (const auto& [id, lens] : poses.lens_states) json["intrinsics"][id] = ToJson(lens);
  json["nuisances"] = ToJson(poses.nuisances);
  json["mountings"] = Json::array();
  for (const auto& mounting : poses.mountings)
    json["mountings"].push_back(
        {{"id", mounting.id},
         {"table_from_model", JsonRows(mounting.table_from_model.isometry())}});
  json["axis_in_camera"] = Json::object();
  for (const auto& [aim, axis] : poses.axis_in_camera)
    json["axis_in_camera"][aim] = {{"direction", JsonVector(axis.direction)},
                                   {"point", JsonVector(axis.point)}};
  json["free_directions"] = Json::array();
  for (const auto& direction : poses.free_directions)
    json["free_directions"].push_back(ToJson(direction));
  json["views"] = Json::array();
  for (const auto& view : poses.views) json["views"].push_back(ToJson(view));
  json["notes"] = poses.notes;
  return json;
}

Result<std::map<std::string, SharedEstimate>> EstimatesFrom(const JsonObject& parent,
                                                            std::string_view key) {
  std::map<std::string, SharedEstimate> estimates;
  SCAN_TRY(const auto object, parent.OptionalObject(key));
  if (!object) return estimates;
  for (const auto& name : object->Keys()) {
    SCAN_TRY(const JsonObject entry, object->Object(name));
    SharedEstimate& estimate = estimates[name];
    SCAN_TRY(estimate.value, entry.Number("value"));
    SCAN_TRY(estimate.sigma, FigureFrom(entry, "sigma"));
    SCAN_TRY(estimate.prior_sigma, FigureFrom(entry, "prior_sigma"));
  }
  return estimates;
}

Result<LensEstimate> LensFrom(const JsonObject& object) {
  LensEstimate lens;
  Intrinsics& in = lens.intrinsics;
  SCAN_TRY(in.w, object.Int("w", 1, kMaxPictureSide));
  SCAN_TRY(in.h, object.Int("h", 1, kMaxPictureSide));
  SCAN_TRY(in.fl_x, object.Number("fl_x"));
  SCAN_TRY(in.fl_y, object.Number("fl_y"));
  SCAN_TRY(in.cx, object.Number("cx"));
  SCAN_TRY(in.cy, object.Number("cy"));
  SCAN_TRY(in.k1, object.Number("k1", 0));
  SCAN_TRY(in.k2, object.Number("k2", 0));
  SCAN_TRY(in.p1, object.Number("p1", 0));
  SCAN_TRY(in.p2, object.Number("p2", 0));
  SCAN_TRY(in.k3, object.Number("k3", 0));
  if (!(in.fl_x > 0) || !(in.fl_y > 0))
    return object.Wrong("fl_x", "the focal length is not positive", "give it in pixels");
  SCAN_TRY(lens.parameters, EstimatesFrom(object, "parameters"));
  return lens;
}

Result<FreeDirection> FreeDirectionFrom(const JsonObject& object) {
  FreeDirection direction;
  SCAN_TRY(direction.kind, object.Choice<FreeDirection::Kind>("kind", kKindNames));
  SCAN_TRY(direction.scope, object.Choice<FreeDirection::Scope>("scope", kScopeNames));
  SCAN_TRY(direction.of, object.Text("of", ""));
  SCAN_TRY(direction.axis, object.Vector3("axis"));
  SCAN_TRY(direction.point, object.Vector3("point"));
  SCAN_TRY(direction.data_sigma, FigureFrom(object, "data_sigma"));
  SCAN_TRY(direction.held_by, object.Text("held_by", ""));
  return direction;
}

Result<ViewPose> ViewFrom(const JsonObject& object) {
  ViewPose view;
  SCAN_TRY(view.name, object.Text("name"));
  SCAN_TRY(view.status, object.Choice<ViewStatus>("status", kStatusNames));
  SCAN_TRY(view.reason, object.Text("reason", ""));
  SCAN_TRY(view.lens_state, object.Text("lens_state"));
  SCAN_TRY(view.mounting, object.Text("mounting"));
  SCAN_TRY(view.aim, object.Text("aim"));
  SCAN_TRY(const Eigen::Isometry3d pose, object.Rigid("camera_from_model"));
  view.camera_from_model = CameraFromModel(pose);
  SCAN_TRY(view.cost_px, FigureFrom(object, "cost_px"));
  SCAN_TRY(view.cost_l1_px, FigureFrom(object, "cost_l1_px"));
  SCAN_TRY(view.contour_rms_px, FigureFrom(object, "contour_rms_px"));
  SCAN_TRY(view.covariance, object.Matrix("covariance", 6, 6));
  SCAN_TRY(const JsonObject sigma, object.Object("surface_sigma_px"));
  SCAN_TRY(view.surface_sigma_px.median, FigureFrom(sigma, "median"));
  SCAN_TRY(view.surface_sigma_px.p95, FigureFrom(sigma, "p95"));
  SCAN_TRY(const auto alternatives, object.Objects("alternatives"));
  for (const auto& entry : alternatives) {
    AlternativePose alternative;
    SCAN_TRY(const Eigen::Isometry3d other, entry.Rigid("camera_from_model"));
    alternative.camera_from_model = CameraFromModel(other);
    SCAN_TRY(alternative.log_likelihood_gap, FigureFrom(entry, "log_likelihood_gap"));
    view.alternatives.push_back(alternative);
  }
  return view;
}

Status ReadShared(const JsonObject& root, Poses& poses) {
  SCAN_TRY(const JsonObject lenses, root.Object("intrinsics"));
  for (const auto& id : lenses.Keys()) {
    SCAN_TRY(const JsonObject lens, lenses.Object(id));
    SCAN_TRY(poses.lens_states[id], LensFrom(lens));
  }
  SCAN_TRY(poses.nuisances, EstimatesFrom(root, "nuisances"));
  SCAN_TRY(const auto mountings, root.Objects("mountings"));
  for (const auto& entry : mountings) {
    MountingEstimate mounting;
    SCAN_TRY(mounting.id, entry.Text("id"));
    SCAN_TRY(const Eigen::Isometry3d pose, entry.Rigid("table_from_model"));
    mounting.table_from_model = TableFromModel(pose);
    poses.mountings.push_back(std::move(mounting));
  }
  SCAN_TRY(const auto axes, root.OptionalObject("axis_in_camera"));
  if (!axes) return {};
  for (const auto& aim : axes->Keys()) {
    SCAN_TRY(const JsonObject axis, axes->Object(aim));
    SCAN_TRY(poses.axis_in_camera[aim].direction, axis.Vector3("direction"));
    SCAN_TRY(poses.axis_in_camera[aim].point, axis.Vector3("point"));
  }
  return {};
}

}  // namespace

Status WritePoses(const std::filesystem::path& path, const Poses& poses) {
  SCAN_TRY(const std::string text, DumpJson(ToJson(poses), 1, path.string()));
  return WriteFileDurably(path, text + "\n");
}

Result<Poses> ReadPoses(const std::filesystem::path& path) {
  SCAN_TRY(const std::string text, ReadTextFile(path));
  SCAN_TRY(const nlohmann::json json, ParseJson(text, path.string()));
  SCAN_TRY(const JsonObject root, JsonObject::Root(json, path.string()));
  SCAN_TRY(const std::string schema, root.Text("schema"));
  if (schema != kSchema)
    return root.Wrong("schema", "unknown schema '" + schema + "'",
                      "this program reads " + std::string(kSchema));
  Poses poses;
  SCAN_TRY(poses.method, root.Text("method"));
  SCAN_TRY(poses.model, root.Text("model"));
  SCAN_CHECK(ReadShared(root, poses));
  SCAN_TRY(const auto directions, root.Objects("free_directions"));
  for (const auto& entry : directions) {
    SCAN_TRY(FreeDirection direction, FreeDirectionFrom(entry));
    poses.free_directions.push_back(std::move(direction));
  }
  SCAN_TRY(const auto views, root.Objects("views"));
  for (const auto& entry : views) {
    SCAN_TRY(ViewPose view, ViewFrom(entry));
    if (!poses.lens_states.contains(view.lens_state))
      return entry.Wrong("lens_state", "unknown lens state '" + view.lens_state + "'",
                         "name one of intrinsics");
    poses.views.push_back(std::move(view));
  }
  if (root.Has("notes")) {
    SCAN_TRY(poses.notes, root.Texts("notes"));
  }
  return poses;
}

const Intrinsics& IntrinsicsOf(const Poses& poses, const ViewPose& view,
                               const Intrinsics& nominal) {
  const auto lens = poses.lens_states.find(view.lens_state);
  return lens != poses.lens_states.end() ? lens->second.intrinsics : nominal;
}

}  // namespace scan
