// Motion over the wire: the protocol of scanstation-motiond.
#pragma once

#include <nlohmann/json.hpp>

#include "drivers/base/result.h"
#include "drivers/motion/motion.h"
#include "firmware-host/protocol/channel.h"

namespace scan {

Json ToJson(const StageTarget& target);
Json ToJson(const HomeReport& report);
Json ToJson(const MoveReport& report);
Json ToJson(const MotionStatus& status);

// Errors: bad_input naming the field.
Result<StageTarget> StageTargetFromJson(const Json& json);
Result<HomeReport> HomeReportFromJson(const Json& json);
Result<MoveReport> MoveReportFromJson(const Json& json);
Result<MotionStatus> MotionStatusFromJson(const Json& json);
// How long the lamp settles, ms, of the answer to set_light.
Result<double> SettleMsFromJson(const Json& json);

const char* AxisStateName(AxisState state);

}  // namespace scan
