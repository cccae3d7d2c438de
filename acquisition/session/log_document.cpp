#include "acquisition/session/log_document.h"

#include <algorithm>
#include <limits>

#include "acquisition/session/document_json.h"
#include "acquisition/session/json_fields.h"
#include "acquisition/session/session_paths.h"

namespace scan {
namespace {

using Json = nlohmann::ordered_json;

// In the order of LogPayload's alternatives.
constexpr std::string_view kTypeNames[] = {
    "start", "home", "move",  "settle", "frame", "reject", "retry", "retake", "plan_extend",
    "mount", "aim",  "pause", "resume", "stop",  "fault",  "note",  "end"};
static_assert(std::size(kTypeNames) == std::variant_size_v<LogPayload>);

constexpr std::string_view kExposureNames[] = {"sensor", "trigger", "hot_shoe", "ptp_bound"};
constexpr std::string_view kStopNames[] = {"stop", "abort", "emergency_stop"};
constexpr std::string_view kPlateNames[] = {"background", "flat", "chart"};
constexpr std::string_view kErrorKindNames[] = {"failed", "bad_input", "cancelled", "device"};
constexpr std::string_view kEndNames[] = {"complete", "incomplete", "stopped", "failed"};
constexpr int kMaxInt = std::numeric_limits<int>::max();

template <class Enum, std::size_t N>
std::string_view Name(Enum value, const std::string_view (&names)[N]) {
  return names[static_cast<std::size_t>(value)];
}

bool IsSha256(std::string_view text) {
  return text.size() == 64 && std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}

Result<std::string> Sha256From(const JsonObject& object, std::string_view key) {
  SCAN_TRY(std::string text, object.Text(key));
  if (!IsSha256(text))
    return object.Wrong(key, "not a SHA-256 in lower-case hex", "restore the file");
  return text;
}

Result<std::uint64_t> CountFrom(const JsonObject& object, std::string_view key) {
  SCAN_TRY(const std::int64_t number, object.Integer(key));
  if (number < 0) return object.Wrong(key, "a negative count", "restore the file");
  return static_cast<std::uint64_t>(number);
}

// A picture lies in frames/ or plates/ and nowhere else.
bool IsPicturePath(std::string_view path) {
  const bool placed = path.starts_with("frames/") || path.starts_with("plates/");
  const std::string_view name = placed ? path.substr(7) : "";
  const std::size_t dot = name.rfind('.');
  return dot != name.npos && dot > 0 && name.front() != '.' &&
         IsPictureExtension(name.substr(dot + 1)) && name.find('/') == name.npos &&
         name.find('\0') == name.npos;
}

Json ToJson(const AxisReading& axis) {
  return {{"commanded", axis.commanded},
          {"counted", axis.counted},
          {"estimated", axis.estimated},
          {"sigma_shared", axis.sigma_shared},
          {"sigma_view", axis.sigma_view}};
}

Json ToJson(const FrameAxes& axes) {
  Json json = Json::object();
  if (axes.turntable_deg) json["turntable_deg"] = ToJson(*axes.turntable_deg);
  if (axes.lift_mm) json["lift_mm"] = ToJson(*axes.lift_mm);
  return json;
}

Json ToJson(const AppliedSettings& applied) {
  Json json = Json::object();
  if (applied.exposure_us) json["exposure_us"] = *applied.exposure_us;
  if (applied.gain) json["gain"] = *applied.gain;
  return json;
}

Json ToJson(const ExposureBound& bound) {
  return {{"not_before_ns", bound.not_before_ns},
          {"not_after_ns", bound.not_after_ns},
          {"source", Name(bound.source, kExposureNames)}};
}

Json ToJson(const std::vector<FileDocument>& files) {
  Json json = Json::array();
  for (const auto& file : files)
    json.push_back({{"path", file.path}, {"bytes", file.bytes}, {"sha256", file.sha256}});
  return json;
}

Result<AxisReading> AxisReadingFrom(const JsonObject& object) {
  AxisReading axis;
  SCAN_TRY(axis.commanded, object.Number("commanded"));
  SCAN_TRY(axis.counted, object.Number("counted"));
  SCAN_TRY(axis.estimated, object.Number("estimated"));
  SCAN_TRY(axis.sigma_shared, object.Number("sigma_shared"));
  SCAN_TRY(axis.sigma_view, object.Number("sigma_view"));
  if (axis.sigma_shared < 0 || axis.sigma_view < 0)
    return object.Wrong("", "a negative sigma", "give 0 or more");
  return axis;
}

Result<FrameAxes> AxesFrom(const JsonObject& object) {
  FrameAxes axes;
  SCAN_TRY(const auto turntable, object.OptionalObject("turntable_deg"));
  if (turntable) {
    SCAN_TRY(axes.turntable_deg, AxisReadingFrom(*turntable));
  }
  SCAN_TRY(const auto lift, object.OptionalObject("lift_mm"));
  if (lift) {
    SCAN_TRY(axes.lift_mm, AxisReadingFrom(*lift));
  }
  return axes;
}

Result<StagePosition> PositionFrom(const JsonObject& object) {
  SCAN_TRY(const JsonObject axes, object.Object("axes"));
  StagePosition position;
  SCAN_TRY(const JsonObject turntable, axes.Object("turntable_deg"));
  SCAN_TRY(position.turntable_deg, AxisReadingFrom(turntable));
  SCAN_TRY(const JsonObject lift, axes.Object("lift_mm"));
  SCAN_TRY(position.lift_mm, AxisReadingFrom(lift));
  return position;
}

Result<AppliedSettings> AppliedFrom(const JsonObject& object) {
  AppliedSettings applied;
  SCAN_TRY(const auto settings, object.OptionalObject("applied"));
  if (settings) {
    SCAN_TRY(applied.exposure_us, settings->OptionalNumber("exposure_us"));
    SCAN_TRY(applied.gain, settings->OptionalNumber("gain"));
  }
  return applied;
}

Result<std::vector<FileDocument>> FilesFrom(const JsonObject& object) {
  SCAN_TRY(const auto entries, object.Objects("files"));
  if (entries.empty()) return object.Wrong("files", "no file", "name at least one picture");
  std::vector<FileDocument> files;
  for (const auto& entry : entries) {
    FileDocument file;
    SCAN_TRY(file.path, entry.Text("path"));
    if (!IsPicturePath(file.path))
      return entry.Wrong("path", "'" + file.path + "' is no picture of the session",
                         "pictures lie in frames/ or plates/");
    SCAN_TRY(file.bytes, CountFrom(entry, "bytes"));
    SCAN_TRY(file.sha256, Sha256From(entry, "sha256"));
    files.push_back(std::move(file));
  }
  return files;
}

struct ToPayloadJson {
  Json& json;

  void operator()(const StartEntry& entry) { json["session_sha256"] = entry.session_sha256; }
  void operator()(const HomeEntry& entry) {
    json["reference_epoch"] = entry.reference_epoch;
    json["axes"] = ToJson(FrameAxes(entry.position));
  }
  void operator()(const MoveEntry& entry) {
    if (!entry.view.empty()) json["view"] = entry.view;
    json["target"] = {{"turntable_deg", entry.target.turntable_deg},
                      {"lift_mm", entry.target.lift_mm},
                      {"aim_id", entry.target.aim_id}};
  }
  void operator()(const SettleEntry& entry) {
    json["settled_mono_ns"] = entry.settled_mono_ns;
    json["axes"] = ToJson(FrameAxes(entry.position));
  }
  void operator()(const FrameEntry& entry) {
    Picture(entry);
    json["files"] = ToJson(entry.files);
    json["sensor_sequence"] = entry.sensor_sequence;
    if (entry.exposure) json["exposure"] = ToJson(*entry.exposure);
    json["applied"] = ToJson(entry.applied);
    json["reference_epoch"] = entry.reference_epoch;
    json["axes"] = ToJson(entry.axes);
    if (entry.camera_from_table)
      json["camera_from_table"] = JsonRows(entry.camera_from_table->isometry());
    if (entry.prior_sigma_view != PriorSigma{})
      json["prior_sigma_view"] = ToJson(entry.prior_sigma_view);
  }
  void operator()(const RejectEntry& entry) {
    if (!entry.view.empty()) json["view"] = entry.view;
    if (!entry.aim_id.empty()) json["aim_id"] = entry.aim_id;
    json["camera"] = entry.camera;
    json["slice"] = entry.slice;
    json["cause"] = entry.cause;
    json["reason"] = entry.reason;
    if (!entry.files.empty()) json["files"] = ToJson(entry.files);
    json["sensor_sequence"] = entry.sensor_sequence;
    if (entry.exposure) json["exposure"] = ToJson(*entry.exposure);
    json["applied"] = ToJson(entry.applied);
  }
  void operator()(const RetryEntry& entry) {
    if (!entry.view.empty()) json["view"] = entry.view;
    if (!entry.camera.empty()) json["camera"] = entry.camera;
    json["slice"] = entry.slice;
    json["attempt"] = entry.attempt;
    json["reason"] = entry.reason;
  }
  void operator()(const RetakeEntry& entry) {
    Picture(entry);
    json["replaces_seq"] = entry.replaces_seq;
    json["reason"] = entry.reason;
  }
  void operator()(const PlanExtendEntry& entry) {
    json["views"] = Json::array();
    for (const auto& view : entry.views) json["views"].push_back(ToJson(view));
  }
  void operator()(const MountEntry& entry) {
    json["mounting_id"] = entry.mounting_id;
    json["text"] = entry.text;
  }
  void operator()(const AimEntry& entry) {
    json["aim_id"] = entry.aim_id;
    json["camera"] = entry.camera;
    if (entry.camera_from_lift)
      json["camera_from_lift"] = JsonRows(entry.camera_from_lift->isometry());
    if (entry.camera_from_lift_sigma)
      json["camera_from_lift_sigma"] = ToJson(*entry.camera_from_lift_sigma);
  }
  void operator()(const PauseEntry& entry) { json["reason"] = entry.reason; }
  void operator()(const ResumeEntry& entry) { json["reason"] = entry.reason; }
  void operator()(const StopEntry& entry) {
    json["kind"] = Name(entry.kind, kStopNames);
    json["reason"] = entry.reason;
  }
  void operator()(const FaultEntry& entry) {
    if (!entry.view.empty()) json["view"] = entry.view;
    json["device"] = entry.device;
    json["what"] = entry.what;
    json["where"] = entry.where;
    json["mend"] = entry.mend;
    json["kind"] = Name(entry.kind, kErrorKindNames);
    if (!entry.call.empty()) json["call"] = entry.call;
  }
  void operator()(const NoteEntry& entry) {
    json["text"] = entry.text;
    if (!entry.values.empty()) json["values"] = entry.values;
    if (!entry.plate) return;
    json["plate"] = Name(entry.plate->plate, kPlateNames);
    json["camera"] = entry.plate->camera;
    if (!entry.plate->aim_id.empty()) json["aim_id"] = entry.plate->aim_id;
    json["files"] = ToJson(entry.plate->files);
    json["sensor_sequence"] = entry.plate->sensor_sequence;
    if (entry.plate->exposure) json["exposure"] = ToJson(*entry.plate->exposure);
    json["applied"] = ToJson(entry.plate->applied);
  }
  void operator()(const EndEntry& entry) {
    json["result"] = Name(entry.result, kEndNames);
    json["reason"] = entry.reason;
  }

 private:
  template <class Entry>
  void Picture(const Entry& entry) {
    json["view"] = entry.view;
    json["camera"] = entry.camera;
    json["slice"] = entry.slice;
  }
};

Result<std::optional<ExposureBound>> ExposureFrom(const JsonObject& object) {
  SCAN_TRY(const auto exposure, object.OptionalObject("exposure"));
  if (!exposure) return std::nullopt;
  ExposureBound bound;
  SCAN_TRY(bound.not_before_ns, exposure->Integer("not_before_ns"));
  SCAN_TRY(bound.not_after_ns, exposure->Integer("not_after_ns"));
  SCAN_TRY(bound.source, exposure->Choice<ExposureSource>("source", kExposureNames));
  return bound;
}

Result<std::uint64_t> OptionalCountFrom(const JsonObject& object, std::string_view key) {
  if (!object.Has(key)) return 0;
  return CountFrom(object, key);
}

template <class Entry>
Status ReadPicture(const JsonObject& object, Entry& entry) {
  SCAN_TRY(entry.view, object.Id("view"));
  SCAN_TRY(entry.camera, object.Id("camera"));
  SCAN_TRY(entry.slice, object.Int("slice", 0, kMaxInt, 0));
  return {};
}

Result<LogPayload> FrameFrom(const JsonObject& object) {
  FrameEntry entry;
  SCAN_CHECK(ReadPicture(object, entry));
  SCAN_TRY(entry.files, FilesFrom(object));
  SCAN_TRY(entry.sensor_sequence, CountFrom(object, "sensor_sequence"));
  SCAN_TRY(entry.exposure, ExposureFrom(object));
  SCAN_TRY(entry.applied, AppliedFrom(object));
  SCAN_TRY(entry.reference_epoch, object.Int("reference_epoch", 0, kMaxInt));
  SCAN_TRY(const auto axes, object.OptionalObject("axes"));
  if (axes) {
    SCAN_TRY(entry.axes, AxesFrom(*axes));
  }
  SCAN_TRY(const auto pose, object.OptionalRigid("camera_from_table"));
  if (pose) entry.camera_from_table = CameraFromTable(*pose);
  SCAN_TRY(const auto sigma, object.OptionalObject("prior_sigma_view"));
  if (sigma) {
    SCAN_TRY(entry.prior_sigma_view, PriorSigmaFrom(*sigma));
  }
  return entry;
}

Result<LogPayload> HomeFrom(const JsonObject& object) {
  HomeEntry entry;
  SCAN_TRY(entry.reference_epoch, object.Int("reference_epoch", 0, kMaxInt));
  SCAN_TRY(entry.position, PositionFrom(object));
  return entry;
}

Result<LogPayload> MoveFrom(const JsonObject& object) {
  MoveEntry entry;
  SCAN_TRY(entry.view, object.Id("view", ""));
  SCAN_TRY(const JsonObject target, object.Object("target"));
  SCAN_TRY(entry.target.turntable_deg, target.Number("turntable_deg"));
  SCAN_TRY(entry.target.lift_mm, target.Number("lift_mm"));
  SCAN_TRY(entry.target.aim_id, target.Id("aim_id"));
  return entry;
}

Result<LogPayload> SettleFrom(const JsonObject& object) {
  SettleEntry entry;
  SCAN_TRY(entry.settled_mono_ns, object.Integer("settled_mono_ns"));
  SCAN_TRY(entry.position, PositionFrom(object));
  return entry;
}

Result<LogPayload> RejectFrom(const JsonObject& object) {
  RejectEntry entry;
  SCAN_TRY(entry.view, object.Id("view", ""));
  SCAN_TRY(entry.aim_id, object.Id("aim_id", ""));
  SCAN_TRY(entry.camera, object.Id("camera"));
  SCAN_TRY(entry.slice, object.Int("slice", 0, kMaxInt, 0));
  SCAN_TRY(entry.cause, object.Text("cause", ""));
  SCAN_TRY(entry.reason, object.Text("reason"));
  if (object.Has("files")) {
    SCAN_TRY(entry.files, FilesFrom(object));
  }
  SCAN_TRY(entry.sensor_sequence, OptionalCountFrom(object, "sensor_sequence"));
  SCAN_TRY(entry.exposure, ExposureFrom(object));
  SCAN_TRY(entry.applied, AppliedFrom(object));
  return entry;
}

Result<LogPayload> RetryFrom(const JsonObject& object) {
  RetryEntry entry;
  SCAN_TRY(entry.view, object.Id("view", ""));
  SCAN_TRY(entry.camera, object.Id("camera", ""));
  SCAN_TRY(entry.slice, object.Int("slice", 0, kMaxInt, 0));
  SCAN_TRY(entry.attempt, object.Int("attempt", 0, kMaxInt));
  SCAN_TRY(entry.reason, object.Text("reason"));
  return entry;
}

Result<LogPayload> RetakeFrom(const JsonObject& object) {
  RetakeEntry entry;
  SCAN_CHECK(ReadPicture(object, entry));
  SCAN_TRY(entry.replaces_seq, object.Integer("replaces_seq"));
  SCAN_TRY(entry.reason, object.Text("reason"));
  return entry;
}

Result<LogPayload> PlanExtendFrom(const JsonObject& object) {
  PlanExtendEntry entry;
  SCAN_TRY(const auto views, object.Objects("views"));
  for (const auto& view_object : views) {
    SCAN_TRY(PlannedView view, PlannedViewFrom(view_object));
    entry.views.push_back(std::move(view));
  }
  return entry;
}

Result<LogPayload> AimFrom(const JsonObject& object) {
  AimEntry entry;
  SCAN_TRY(entry.aim_id, object.Id("aim_id"));
  SCAN_TRY(entry.camera, object.Id("camera"));
  SCAN_TRY(const auto pose, object.OptionalRigid("camera_from_lift"));
  if (pose) entry.camera_from_lift = CameraFromLift(*pose);
  SCAN_TRY(const auto sigma, object.OptionalObject("camera_from_lift_sigma"));
  if (sigma) {
    SCAN_TRY(entry.camera_from_lift_sigma, PriorSigmaFrom(*sigma));
  }
  return entry;
}

Result<LogPayload> NoteFrom(const JsonObject& object) {
  NoteEntry entry;
  SCAN_TRY(entry.text, object.Text("text"));
  SCAN_TRY(const auto values, object.OptionalObject("values"));
  if (values) {
    for (const auto& key : values->Keys()) {
      SCAN_TRY(entry.values[key], values->Text(key));
    }
  }
  if (!object.Has("plate")) return entry;
  PlateDocument plate;
  SCAN_TRY(plate.plate, object.Choice<PlateKind>("plate", kPlateNames));
  SCAN_TRY(plate.camera, object.Id("camera"));
  SCAN_TRY(plate.aim_id, object.Id("aim_id", ""));
  SCAN_TRY(plate.files, FilesFrom(object));
  SCAN_TRY(plate.sensor_sequence, OptionalCountFrom(object, "sensor_sequence"));
  SCAN_TRY(plate.exposure, ExposureFrom(object));
  SCAN_TRY(plate.applied, AppliedFrom(object));
  entry.plate = std::move(plate);
  return entry;
}

Result<LogPayload> FaultFrom(const JsonObject& object) {
  FaultEntry entry;
  SCAN_TRY(entry.device, object.Text("device"));
  SCAN_TRY(entry.what, object.Text("what"));
  SCAN_TRY(entry.where, object.Text("where", ""));
  SCAN_TRY(entry.mend, object.Text("mend", ""));
  SCAN_TRY(entry.view, object.Id("view", ""));
  SCAN_TRY(entry.call, object.Text("call", ""));
  if (object.Has("kind")) {
    SCAN_TRY(entry.kind, object.Choice<ErrorKind>("kind", kErrorKindNames));
  }
  return entry;
}

Result<LogPayload> StopFrom(const JsonObject& object) {
  StopEntry entry;
  SCAN_TRY(entry.kind, object.Choice<StopKind>("kind", kStopNames));
  SCAN_TRY(entry.reason, object.Text("reason", ""));
  return entry;
}

Result<LogPayload> EndFrom(const JsonObject& object) {
  EndEntry entry;
  SCAN_TRY(entry.result, object.Choice<EndResult>("result", kEndNames));
  SCAN_TRY(entry.reason, object.Text("reason", ""));
  return entry;
}

Result<LogPayload> StartFrom(const JsonObject& object) {
  StartEntry entry;
  SCAN_TRY(entry.session_sha256, Sha256From(object, "session_sha256"));
  return entry;
}

Result<LogPayload> MountFrom(const JsonObject& object) {
  MountEntry entry;
  SCAN_TRY(entry.mounting_id, object.Id("mounting_id"));
  SCAN_TRY(entry.text, object.Text("text", ""));
  return entry;
}

template <class Entry>
Result<LogPayload> ReasonFrom(const JsonObject& object) {
  Entry entry;
  SCAN_TRY(entry.reason, object.Text("reason", ""));
  return entry;
}

Result<LogPayload> PayloadFrom(const JsonObject& object) {
  // In the order of kTypeNames.
  using Reader = Result<LogPayload> (*)(const JsonObject&);
  static constexpr Reader kReaders[] = {StartFrom,
                                        HomeFrom,
                                        MoveFrom,
                                        SettleFrom,
                                        FrameFrom,
                                        RejectFrom,
                                        RetryFrom,
                                        RetakeFrom,
                                        PlanExtendFrom,
                                        MountFrom,
                                        AimFrom,
                                        ReasonFrom<PauseEntry>,
                                        ReasonFrom<ResumeEntry>,
                                        StopFrom,
                                        FaultFrom,
                                        NoteFrom,
                                        EndFrom};
  static_assert(std::size(kReaders) == std::size(kTypeNames));
  enum class Type : std::size_t {};
  SCAN_TRY(const Type type, object.Choice<Type>("type", kTypeNames));
  return kReaders[static_cast<std::size_t>(type)](object);
}

}  // namespace

std::string_view TypeName(const LogPayload& payload) { return kTypeNames[payload.index()]; }

Result<std::string> SerialiseLogEntry(const LogEntry& entry) {
  Json json = {{"seq", entry.seq},
               {"utc_ns", entry.time.utc_ns},
               {"mono_ns", entry.time.mono_ns},
               {"prev_sha256", entry.prev_sha256},
               {"type", TypeName(entry.payload)}};
  std::visit(ToPayloadJson{json}, entry.payload);
  return DumpJson(json, -1, "log.jsonl");
}

Result<LogEntry> ParseLogEntry(std::string_view line, const std::string& where) {
  SCAN_TRY(const nlohmann::json json, ParseJson(line, where));
  SCAN_TRY(const JsonObject root, JsonObject::Root(json, where));
  LogEntry entry;
  SCAN_TRY(entry.seq, root.Integer("seq"));
  SCAN_TRY(entry.time.utc_ns, root.Integer("utc_ns"));
  SCAN_TRY(entry.time.mono_ns, root.Integer("mono_ns"));
  SCAN_TRY(entry.prev_sha256, Sha256From(root, "prev_sha256"));
  SCAN_TRY(entry.payload, PayloadFrom(root));
  return entry;
}

}  // namespace scan
