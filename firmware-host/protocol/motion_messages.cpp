#include "firmware-host/protocol/motion_messages.h"

#include <fmt/format.h>

#include <array>

#include "drivers/io/light_config.h"

namespace scan {
namespace {

constexpr std::array kStates = {AxisState::unpowered, AxisState::unreferenced, AxisState::idle,
                                AxisState::moving,    AxisState::held,         AxisState::fault};

Json ToJson(const AxisReading& reading) {
  return {{"commanded", reading.commanded},
          {"counted", reading.counted},
          {"estimated", reading.estimated},
          {"sigma_shared", reading.sigma_shared},
          {"sigma_view", reading.sigma_view}};
}

Json ToJson(const StagePosition& position) {
  return {{"turntable_deg", ToJson(position.turntable_deg)}, {"lift_mm", ToJson(position.lift_mm)}};
}

AxisReading ReadingFrom(const Json& json) {
  return {json.at("commanded").get<double>(), json.at("counted").get<double>(),
          json.at("estimated").get<double>(), json.at("sigma_shared").get<double>(),
          json.at("sigma_view").get<double>()};
}

StagePosition PositionFrom(const Json& json) {
  return {ReadingFrom(json.at("turntable_deg")), ReadingFrom(json.at("lift_mm"))};
}

AxisState StateFrom(const Json& json) {
  const auto name = json.get<std::string>();
  for (AxisState state : kStates)
    if (name == AxisStateName(state)) return state;
  throw nlohmann::json::other_error::create(501, "unknown axis state " + name, &json);
}

Alarm AlarmFrom(const Json& json) {
  const auto name = json.get<std::string>();
  for (const Alarm alarm : {Alarm::none, Alarm::minor, Alarm::major, Alarm::invalid})
    if (name == NameOf(alarm)) return alarm;
  throw nlohmann::json::other_error::create(501, "unknown alarm " + name, &json);
}

// The one place where nlohmann's exceptions become a Result.
template <class T, class Read>
Result<T> Guarded(const char* message, const Json& json, Read read) {
  try {
    return read(json);
  } catch (const nlohmann::json::exception& e) {
    return BadInput(std::string("malformed message (") + e.what() + ")", message,
                    "use programs of the same version");
  }
}

}  // namespace

const char* AxisStateName(AxisState state) {
  switch (state) {
    case AxisState::unpowered:
      return "unpowered";
    case AxisState::unreferenced:
      return "unreferenced";
    case AxisState::idle:
      return "idle";
    case AxisState::moving:
      return "moving";
    case AxisState::held:
      return "held";
    case AxisState::fault:
      return "fault";
  }
  return "fault";
}

Json ToJson(const StageTarget& target) {
  return {{"turntable_deg", target.turntable_deg},
          {"lift_mm", target.lift_mm},
          {"aim_id", target.aim_id}};
}
Json ToJson(const HomeReport& report) {
  return {{"reference_epoch", report.reference_epoch}, {"position", ToJson(report.position)}};
}
Json ToJson(const MoveReport& report) {
  return {{"settled_mono_ns", report.settled_mono_ns}, {"position", ToJson(report.position)}};
}
Json ToJson(const MotionStatus& status) {
  return {{"turntable", AxisStateName(status.turntable)},
          {"lift", AxisStateName(status.lift)},
          {"reference_epoch", status.reference_epoch},
          {"position", ToJson(status.position)},
          {"fault", status.fault},
          {"alarm", NameOf(status.alarm)},
          {"interlocks", status.interlocks}};
}

Result<StageTarget> StageTargetFromJson(const Json& json) {
  return Guarded<StageTarget>("move_to", json, [](const Json& j) {
    return StageTarget{j.at("turntable_deg").get<double>(), j.at("lift_mm").get<double>(),
                       j.at("aim_id").get<std::string>()};
  });
}
Result<HomeReport> HomeReportFromJson(const Json& json) {
  return Guarded<HomeReport>("home", json, [](const Json& j) {
    return HomeReport{j.at("reference_epoch").get<int>(), PositionFrom(j.at("position"))};
  });
}
Result<MoveReport> MoveReportFromJson(const Json& json) {
  return Guarded<MoveReport>("move_to", json, [](const Json& j) {
    return MoveReport{PositionFrom(j.at("position")), j.at("settled_mono_ns").get<std::int64_t>()};
  });
}
Result<MotionStatus> MotionStatusFromJson(const Json& json) {
  return Guarded<MotionStatus>("status", json, [](const Json& j) {
    return MotionStatus{StateFrom(j.at("turntable")),         StateFrom(j.at("lift")),
                        j.at("reference_epoch").get<int>(),   PositionFrom(j.at("position")),
                        j.at("fault").get<std::string>(),     AlarmFrom(j.at("alarm")),
                        j.at("interlocks").get<std::string>()};
  });
}
Result<double> SettleMsFromJson(const Json& json) {
  SCAN_TRY(const double ms, Guarded<double>("set_light", json, [](const Json& j) {
             return j.at("settle_ms").get<double>();
           }));
  if (ms >= 0 && ms <= kMaxSettleMs) return ms;
  return BadInput(fmt::format("a lamp does not settle for {} ms", ms), "set_light",
                  "use programs of the same version");
}

}  // namespace scan
