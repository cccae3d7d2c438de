#include "acquisition/session/session_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "acquisition/session/document_json.h"
#include "acquisition/session/json_fields.h"

namespace scan {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kOnStopNames[] = {"release", "hold", "brake"};
constexpr std::string_view kLiftKindNames[] = {"fixed_pitch", "manual_aim", "arc", "pitch_axis"};
constexpr int kMaxPictureSide = 1 << 17;
constexpr int kMaxSlices = 10000;

Json ToJson(const std::optional<double>& number) { return number ? Json(*number) : Json(nullptr); }

Json ToJson(const CtDocument& ct) {
  return {{"voxel_mm", JsonVector(ct.voxel_mm)},
          {"scanner", ct.scanner},
          {"kv", ct.kv},
          {"ua", ct.ua},
          {"filter", ct.filter},
          {"source_object_mm", ct.source_object_mm},
          {"source_detector_mm", ct.source_detector_mm},
          {"rights", ct.rights}};
}

Json ToJson(const AxisDocument& axis) {
  return {{"unit", axis.unit},
          {"steps_per_unit", axis.steps_per_unit},
          {"sign", axis.sign},
          {"min", ToJson(axis.min)},
          {"max", ToJson(axis.max)},
          {"backlash", axis.backlash},
          {"on_stop", kOnStopNames[static_cast<std::size_t>(axis.on_stop)]}};
}

Json ToJson(const CameraDocument& camera) {
  Json poses = Json::object();
  for (const auto& [aim, pose] : camera.camera_from_lift)
    poses[aim] = pose ? JsonRows(pose->isometry()) : Json(nullptr);
  Json json = {{"id", camera.id}};
  json.update(ToJson(camera.intrinsics));
  json.update({{"sigma", {{"fl_rel", camera.sigma.fl_rel}, {"c_px", camera.sigma.c_px}}},
               {"camera_from_lift", std::move(poses)},
               {"camera_from_lift_sigma", ToJson(camera.camera_from_lift_sigma)}});
  if (!camera.camera_from_lift_sigma_by_aim.empty()) {
    Json& by_aim = json["camera_from_lift_sigma_by_aim"] = Json::object();
    for (const auto& [aim, sigma] : camera.camera_from_lift_sigma_by_aim)
      by_aim[aim] = ToJson(sigma);
  }
  if (!camera.lens_state.empty()) {
    Json& states = json["lens_state"] = Json::object();
    for (const auto& [aim, state] : camera.lens_state) states[aim] = state;
  }
  return json;
}

Json ToJson(const StationDocument& station) {
  Json axes = Json::object();
  if (station.turntable) axes["turntable"] = ToJson(*station.turntable);
  if (station.lift_axis) axes["lift"] = ToJson(*station.lift_axis);
  Json cameras = Json::array();
  for (const auto& camera : station.cameras) cameras.push_back(ToJson(camera));
  return {{"axes", std::move(axes)},
          {"lift",
           {{"kind", kLiftKindNames[static_cast<std::size_t>(station.lift.kind)]},
            {"direction_in_station", JsonVector(station.lift.direction_in_station)}}},
          {"cameras", std::move(cameras)}};
}

Result<CtDocument> CtFrom(const JsonObject& object) {
  CtDocument ct;
  SCAN_TRY(ct.voxel_mm, object.Vector3("voxel_mm"));
  SCAN_TRY(ct.scanner, object.Text("scanner", ""));
  SCAN_TRY(ct.kv, object.Number("kv", 0));
  SCAN_TRY(ct.ua, object.Number("ua", 0));
  SCAN_TRY(ct.filter, object.Text("filter", ""));
  SCAN_TRY(ct.source_object_mm, object.Number("source_object_mm", 0));
  SCAN_TRY(ct.source_detector_mm, object.Number("source_detector_mm", 0));
  SCAN_TRY(ct.rights, object.Text("rights", ""));
  return ct;
}

Result<AxisDocument> AxisFrom(const JsonObject& object) {
  AxisDocument axis;
  SCAN_TRY(axis.unit, object.Text("unit"));
  SCAN_TRY(axis.steps_per_unit, object.Number("steps_per_unit", 0));
  SCAN_TRY(axis.sign, object.Int("sign", -1, 1, 1));
  SCAN_TRY(axis.min, object.OptionalNumber("min"));
  SCAN_TRY(axis.max, object.OptionalNumber("max"));
  SCAN_TRY(axis.backlash, object.Number("backlash", 0));
  if (object.Has("on_stop")) {
    SCAN_TRY(axis.on_stop, object.Choice<OnStop>("on_stop", kOnStopNames));
  }
  return axis;
}

Result<Intrinsics> IntrinsicsFrom(const JsonObject& object) {
  Intrinsics in;
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
  return in;
}

Result<CameraDocument> CameraFrom(const JsonObject& object) {
  CameraDocument camera;
  SCAN_TRY(camera.id, object.Id("id"));
  SCAN_TRY(camera.intrinsics, IntrinsicsFrom(object));
  SCAN_TRY(const auto sigma, object.OptionalObject("sigma"));
  if (sigma) {
    SCAN_TRY(camera.sigma.fl_rel, sigma->Number("fl_rel", camera.sigma.fl_rel));
    SCAN_TRY(camera.sigma.c_px, sigma->Number("c_px", camera.sigma.c_px));
  }
  SCAN_TRY(const JsonObject poses, object.Object("camera_from_lift"));
  for (const auto& aim : poses.Keys()) {
    SCAN_TRY(const auto pose, poses.OptionalRigid(aim));
    camera.camera_from_lift[aim] = pose ? std::optional(CameraFromLift(*pose)) : std::nullopt;
  }
  SCAN_TRY(const auto lift_sigma, object.OptionalObject("camera_from_lift_sigma"));
  if (lift_sigma) {
    SCAN_TRY(camera.camera_from_lift_sigma, PriorSigmaFrom(*lift_sigma));
  }
  SCAN_TRY(const auto by_aim, object.OptionalObject("camera_from_lift_sigma_by_aim"));
  if (by_aim) {
    for (const auto& aim : by_aim->Keys()) {
      SCAN_TRY(const JsonObject of_aim, by_aim->Object(aim));
      SCAN_TRY(camera.camera_from_lift_sigma_by_aim[aim], PriorSigmaFrom(of_aim));
    }
  }
  SCAN_TRY(const auto states, object.OptionalObject("lens_state"));
  if (states) {
    for (const auto& aim : states->Keys()) {
      SCAN_TRY(camera.lens_state[aim], states->Id(aim));
    }
  }
  return camera;
}

Result<StationDocument> StationFrom(const JsonObject& object) {
  StationDocument station;
  SCAN_TRY(const auto axes, object.OptionalObject("axes"));
  if (axes) {
    SCAN_TRY(const auto turntable, axes->OptionalObject("turntable"));
    if (turntable) {
      SCAN_TRY(station.turntable, AxisFrom(*turntable));
    }
    SCAN_TRY(const auto lift_axis, axes->OptionalObject("lift"));
    if (lift_axis) {
      SCAN_TRY(station.lift_axis, AxisFrom(*lift_axis));
    }
  }
  SCAN_TRY(const auto lift, object.OptionalObject("lift"));
  if (lift) {
    SCAN_TRY(station.lift.kind, lift->Choice<LiftKind>("kind", kLiftKindNames));
    SCAN_TRY(station.lift.direction_in_station, lift->Vector3("direction_in_station"));
  }
  SCAN_TRY(const auto cameras, object.Objects("cameras"));
  for (const auto& entry : cameras) {
    SCAN_TRY(CameraDocument camera, CameraFrom(entry));
    station.cameras.push_back(std::move(camera));
  }
  return station;
}

bool IsSigma(double sigma) { return std::isfinite(sigma) && sigma >= 0; }
bool IsSigma(const PriorSigma& sigma) {
  return IsSigma(sigma.rotation_deg) && IsSigma(sigma.translation_mm);
}

Status ValidateAxis(const AxisDocument& axis, std::string_view unit, const std::string& where) {
  if (axis.unit != unit)
    return BadInput("unit '" + axis.unit + "' is not known here", where + ".unit",
                    "use " + std::string(unit));
  if (axis.sign != 1 && axis.sign != -1)
    return BadInput("the sign must be 1 or -1", where + ".sign", "use 1 or -1");
  if (axis.min && axis.max && !(*axis.min <= *axis.max))
    return BadInput("min is above max", where + ".min", "exchange them");
  if (!(axis.backlash >= 0))
    return BadInput("a negative backlash", where + ".backlash", "give 0 or more");
  return {};
}

Status ValidateCamera(const CameraDocument& camera, const std::string& where) {
  const Intrinsics& in = camera.intrinsics;
  if (!IsId(camera.id))
    return BadInput("'" + camera.id + "' is no id", where + ".id",
                    "use only a to z, 0 to 9 and hyphens");
  if (in.w < 1 || in.h < 1 || in.w > kMaxPictureSide || in.h > kMaxPictureSide)
    return BadInput(fmt::format("a picture of {} x {}", in.w, in.h), where + ".w",
                    "give the size of the pictures in pixels");
  if (!(in.fl_x > 0) || !(in.fl_y > 0))
    return BadInput("the focal length is not positive", where + ".fl_x", "give it in pixels");
  if (!IsSigma(camera.sigma.fl_rel) || !IsSigma(camera.sigma.c_px))
    return BadInput("a negative sigma", where + ".sigma", "give 0 or more");
  if (!IsSigma(camera.camera_from_lift_sigma))
    return BadInput("a negative sigma", where + ".camera_from_lift_sigma", "give 0 or more");
  const auto known = [&](const std::string& aim) { return camera.camera_from_lift.contains(aim); };
  for (const auto& [aim, pose] : camera.camera_from_lift)
    if (!IsId(aim))
      return BadInput("'" + aim + "' is no id", where + ".camera_from_lift",
                      "use only a to z, 0 to 9 and hyphens");
  for (const auto& [aim, sigma] : camera.camera_from_lift_sigma_by_aim)
    if (!known(aim) || !IsSigma(sigma))
      return BadInput("an unknown aim or a negative sigma",
                      where + ".camera_from_lift_sigma_by_aim." + aim,
                      "name an aim of camera_from_lift and give 0 or more");
  for (const auto& [aim, state] : camera.lens_state)
    if (!known(aim) || !IsId(state))
      return BadInput("an unknown aim or no id", where + ".lens_state." + aim,
                      "name an aim of camera_from_lift and an id");
  return {};
}

}  // namespace

Json ToJson(const Intrinsics& in) {
  return {{"w", in.w},   {"h", in.h},   {"fl_x", in.fl_x}, {"fl_y", in.fl_y},
          {"cx", in.cx}, {"cy", in.cy}, {"k1", in.k1},     {"k2", in.k2},
          {"p1", in.p1}, {"p2", in.p2}, {"k3", in.k3}};
}

Json ToJson(const PriorSigma& sigma) {
  return {{"rotation_deg", sigma.rotation_deg}, {"translation_mm", sigma.translation_mm}};
}

Result<PriorSigma> PriorSigmaFrom(const JsonObject& object) {
  PriorSigma sigma;
  SCAN_TRY(sigma.rotation_deg, object.Number("rotation_deg", 0));
  SCAN_TRY(sigma.translation_mm, object.Number("translation_mm", 0));
  if (!IsSigma(sigma)) return object.Wrong("", "a negative sigma", "give 0 or more");
  return sigma;
}

Json ToJson(const PlannedView& view) {
  Json json = {{"id", view.id},
               {"camera", view.camera},
               {"turntable_deg", view.turntable_deg},
               {"lift_mm", view.lift_mm},
               {"exposure_us", view.exposure_us},
               {"slices", view.slices},
               {"mounting_id", view.mounting_id},
               {"aim_id", view.aim_id}};
  if (!view.name.empty()) json["name"] = view.name;
  return json;
}

Result<PlannedView> PlannedViewFrom(const JsonObject& object) {
  PlannedView view;
  SCAN_TRY(view.id, object.Id("id"));
  SCAN_TRY(view.camera, object.Id("camera"));
  SCAN_TRY(view.turntable_deg, object.Number("turntable_deg"));
  SCAN_TRY(view.lift_mm, object.Number("lift_mm"));
  SCAN_TRY(view.exposure_us, object.Number("exposure_us", 0));
  SCAN_TRY(view.slices, object.Int("slices", 1, kMaxSlices, 1));
  SCAN_TRY(view.mounting_id, object.Id("mounting_id", "m0"));
  SCAN_TRY(view.aim_id, object.Id("aim_id", "a0"));
  SCAN_TRY(view.name, object.Text("name", ""));
  return view;
}

Status ValidatePlannedView(const PlannedView& view, const std::vector<CameraDocument>& cameras,
                           const std::string& where) {
  for (const auto* id : {&view.id, &view.camera, &view.mounting_id, &view.aim_id})
    if (!IsId(*id))
      return BadInput("'" + *id + "' is no id", where, "use only a to z, 0 to 9 and hyphens");
  if (!std::isfinite(view.turntable_deg) || !std::isfinite(view.lift_mm))
    return BadInput("a position that is not finite", where, "give finite numbers");
  if (!(view.exposure_us >= 0) || !std::isfinite(view.exposure_us))
    return BadInput("the exposure is negative", where + ".exposure_us", "give 0 or more");
  if (view.slices < 1 || view.slices > kMaxSlices)
    return BadInput(fmt::format("{} slices", view.slices), where + ".slices",
                    fmt::format("give 1 to {}", kMaxSlices));
  const auto camera = std::find_if(cameras.begin(), cameras.end(),
                                   [&](const auto& entry) { return entry.id == view.camera; });
  if (camera == cameras.end())
    return BadInput("unknown camera '" + view.camera + "'", where + ".camera",
                    "name one of station.cameras");
  if (!camera->camera_from_lift.contains(view.aim_id))
    return BadInput("camera '" + view.camera + "' has no aim '" + view.aim_id + "'",
                    where + ".aim_id", "name one of its camera_from_lift");
  return {};
}

Status ValidateSessionDocument(const SessionDocument& document, const std::string& file) {
  const std::string at = file + ": ";
  const StationDocument& station = document.station;
  if (!IsId(document.id))
    return BadInput("'" + document.id + "' is no id", at + "id",
                    "use only a to z, 0 to 9 and hyphens");
  if (document.ct && !(document.ct->voxel_mm.minCoeff() >= 0))
    return BadInput("a negative voxel size", at + "ct.voxel_mm", "give mm, or 0 where not known");
  if (station.turntable) {
    SCAN_CHECK(ValidateAxis(*station.turntable, "deg", at + "station.axes.turntable"));
  }
  if (station.lift_axis) {
    SCAN_CHECK(ValidateAxis(*station.lift_axis, "mm", at + "station.axes.lift"));
  }
  if (!(std::abs(station.lift.direction_in_station.norm() - 1) < 1e-6))
    return BadInput("not of unit length", at + "station.lift.direction_in_station",
                    "give a vector of length 1");
  if (document.approx_distance_mm && !(*document.approx_distance_mm > 0))
    return BadInput("not positive", at + "approx_distance_mm", "give mm");
  if (station.cameras.empty())
    return BadInput("no camera", at + "station.cameras", "name at least one");

  std::set<std::string> ids;
  for (std::size_t i = 0; i < station.cameras.size(); ++i) {
    const std::string where = fmt::format("{}station.cameras[{}]", at, i);
    SCAN_CHECK(ValidateCamera(station.cameras[i], where));
    if (!ids.insert(station.cameras[i].id).second)
      return BadInput("camera '" + station.cameras[i].id + "' stands twice", where + ".id",
                      "give each camera its own id");
  }
  ids.clear();
  for (std::size_t i = 0; i < document.views.size(); ++i) {
    const std::string where = fmt::format("{}views[{}]", at, i);
    SCAN_CHECK(ValidatePlannedView(document.views[i], station.cameras, where));
    if (!ids.insert(document.views[i].id).second)
      return BadInput("view '" + document.views[i].id + "' stands twice", where + ".id",
                      "give each view its own id");
  }
  return {};
}

Result<std::string> SerialiseSessionDocument(const SessionDocument& document) {
  SCAN_CHECK(ValidateSessionDocument(document, "session.json"));
  Json json = {
      {"schema", kSessionSchema},
      {"id", document.id},
      {"created_utc_ns", document.created_utc_ns},
      {"software", {{"name", document.software.name}, {"version", document.software.version}}}};
  json["specimen"] = Json::object();
  for (const auto& [term, value] : document.specimen) json["specimen"][term] = value;
  if (document.ct) json["ct"] = ToJson(*document.ct);
  json["station"] = ToJson(document.station);
  if (document.approx_distance_mm) json["approx_distance_mm"] = *document.approx_distance_mm;
  json["views"] = Json::array();
  for (const auto& view : document.views) json["views"].push_back(ToJson(view));
  SCAN_TRY(std::string text, DumpJson(json, 1, "session.json"));
  return text + "\n";
}

Result<SessionDocument> ParseSessionDocument(std::string_view text, const std::string& file) {
  SCAN_TRY(const nlohmann::json json, ParseJson(text, file));
  SCAN_TRY(const JsonObject root, JsonObject::Root(json, file));
  SCAN_TRY(const std::string schema, root.Text("schema"));
  if (schema != kSessionSchema)
    return root.Wrong("schema", "unknown schema '" + schema + "'",
                      "this program reads " + std::string(kSessionSchema));
  SessionDocument document;
  SCAN_TRY(document.id, root.Id("id"));
  SCAN_TRY(document.created_utc_ns, root.Integer("created_utc_ns"));
  SCAN_TRY(const JsonObject software, root.Object("software"));
  SCAN_TRY(document.software.name, software.Text("name"));
  SCAN_TRY(document.software.version, software.Text("version", ""));
  SCAN_TRY(const auto specimen, root.OptionalObject("specimen"));
  if (specimen) {
    for (const auto& term : specimen->Keys()) {
      SCAN_TRY(document.specimen[term], specimen->Text(term));
    }
  }
  SCAN_TRY(const auto ct, root.OptionalObject("ct"));
  if (ct) {
    SCAN_TRY(document.ct, CtFrom(*ct));
  }
  SCAN_TRY(const JsonObject station, root.Object("station"));
  SCAN_TRY(document.station, StationFrom(station));
  SCAN_TRY(document.approx_distance_mm, root.OptionalNumber("approx_distance_mm"));
  SCAN_TRY(const auto views, root.Objects("views"));
  for (const auto& entry : views) {
    SCAN_TRY(PlannedView view, PlannedViewFrom(entry));
    document.views.push_back(std::move(view));
  }
  SCAN_CHECK(ValidateSessionDocument(document, file));
  return document;
}

}  // namespace scan
