// log.jsonl: what happened, one document a line, chained by hash.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "acquisition/session/session_document.h"
#include "drivers/base/clock.h"
#include "drivers/base/frames.h"
#include "drivers/base/result.h"
#include "drivers/camera/camera.h"
#include "drivers/motion/motion.h"

namespace scan {

// prev_sha256 of the first line.
inline constexpr std::string_view kNoPreviousLine =
    "0000000000000000000000000000000000000000000000000000000000000000";

// A picture of the session, durable before a document names it.
struct FileDocument {
  std::string path;  // relative to the session, with '/'
  std::uint64_t bytes = 0;
  std::string sha256;
  friend bool operator==(const FileDocument&, const FileDocument&) = default;
};

struct StartEntry {
  std::string session_sha256;  // of session.json
};
struct HomeEntry {
  int reference_epoch = 0;
  StagePosition position;
};
struct MoveEntry {
  std::string view;  // empty: for no view
  StageTarget target;
};
struct SettleEntry {
  std::int64_t settled_mono_ns = 0;
  StagePosition position;
};
// An axis that was not logged is empty (photographs taken elsewhere).
struct FrameAxes {
  std::optional<AxisReading> turntable_deg;
  std::optional<AxisReading> lift_mm;

  FrameAxes() = default;
  FrameAxes(const StagePosition& position)  // NOLINT: a position is a complete set of axes
      : turntable_deg(position.turntable_deg), lift_mm(position.lift_mm) {}
  friend bool operator==(const FrameAxes&, const FrameAxes&) = default;
};
struct FrameEntry {
  std::string view;
  std::string camera;
  int slice = 0;
  std::vector<FileDocument> files;  // RAW + JPEG of one exposure are two
  std::uint64_t sensor_sequence = 0;
  std::optional<ExposureBound> exposure;
  AppliedSettings applied;
  int reference_epoch = 1;
  FrameAxes axes;
  std::optional<CameraFromTable> camera_from_table;  // nominal
  PriorSigma prior_sigma_view;                       // further independent error of this frame
};
// A picture that did not count, why, and all that its judgement rests on.
struct RejectEntry {
  std::string view;    // empty: of a plate
  std::string aim_id;  // of a plate
  std::string camera;
  int slice = 0;
  std::string reason;
  std::string cause;                // the reason's kind: before_settled, settings ...
  std::vector<FileDocument> files;  // kept beside the frames; may be none
  std::uint64_t sensor_sequence = 0;
  std::optional<ExposureBound> exposure;
  AppliedSettings applied;
};
struct RetryEntry {
  std::string view, camera;  // empty: of no view (homing, light, a plate)
  int slice = 0;
  int attempt = 0;  // the one that begins, from 2
  std::string reason;
};
// From here on the frame document `replaces_seq` is void; its pictures stay.
struct RetakeEntry {
  std::int64_t replaces_seq = 0;
  std::string view, camera;
  int slice = 0;
  std::string reason;
};
struct PlanExtendEntry {
  std::vector<PlannedView> views;
};
struct MountEntry {
  std::string mounting_id;
  std::string text;
};
// A new aim of a camera, or one of the plan that is taken up.
struct AimEntry {
  std::string aim_id, camera;
  std::optional<CameraFromLift> camera_from_lift;  // nominal, of an aim that the plan does not know
  std::optional<PriorSigma> camera_from_lift_sigma;
};
struct PauseEntry {
  std::string reason;
};
struct ResumeEntry {
  std::string reason;
};
enum class StopKind { stop, abort, emergency_stop };
struct StopEntry {
  StopKind kind = StopKind::stop;
  std::string reason;
};
struct FaultEntry {
  std::string device, what, mend;
  std::string where;
  ErrorKind kind = ErrorKind::device;
  std::string view;  // during which it happened; empty: none
  std::string call;  // of the device that failed: home move configure grab set; empty: none
};
enum class PlateKind { background, flat, chart };
struct PlateDocument {
  PlateKind plate = PlateKind::background;
  std::string camera;
  std::string aim_id;  // of a background
  std::vector<FileDocument> files;
  AppliedSettings applied;
  std::uint64_t sensor_sequence = 0;
  std::optional<ExposureBound> exposure = {};
};
// A plate is logged as a note with its files.
struct NoteEntry {
  std::string text;
  std::optional<PlateDocument> plate;
  std::map<std::string, std::string> values = {};  // for programs
};
enum class EndResult { complete, incomplete, stopped, failed };
struct EndEntry {
  EndResult result = EndResult::complete;
  std::string reason;
};

using LogPayload =
    std::variant<StartEntry, HomeEntry, MoveEntry, SettleEntry, FrameEntry, RejectEntry, RetryEntry,
                 RetakeEntry, PlanExtendEntry, MountEntry, AimEntry, PauseEntry, ResumeEntry,
                 StopEntry, FaultEntry, NoteEntry, EndEntry>;

struct LogEntry {
  std::int64_t seq = 0;
  Timestamp time;
  std::string prev_sha256 = std::string(kNoPreviousLine);
  LogPayload payload;
};

// start, home, move ...
std::string_view TypeName(const LogPayload& payload);

// The line without its newline. Errors: failed for a number that is not finite.
Result<std::string> SerialiseLogEntry(const LogEntry& entry);

// Errors: bad_input naming `where` (file and line) and the path of the field.
Result<LogEntry> ParseLogEntry(std::string_view line, const std::string& where);

}  // namespace scan
