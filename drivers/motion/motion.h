// Everything that moves on a station: turntable and camera lift.
#pragma once

#include <cstdint>
#include <stop_token>
#include <string>
#include <string_view>

#include "drivers/base/result.h"

namespace scan {

// What is known of one axis after a move, in the axis' own unit (deg or mm).
struct AxisReading {
  double commanded = 0;     // what was asked for
  double counted = 0;       // from the step edges really emitted
  double estimated = 0;     // counted, corrected by what is known of backlash and scale
  double sigma_shared = 0;  // error common to the reference epoch (homing offset)
  double sigma_view = 0;    // error of this move alone
  friend bool operator==(const AxisReading&, const AxisReading&) = default;
};

struct StagePosition {
  AxisReading turntable_deg;
  AxisReading lift_mm;
  friend bool operator==(const StagePosition&, const StagePosition&) = default;
};

// The aim names a preset of the camera's pitch axis; a station without one ignores it.
struct StageTarget {
  double turntable_deg = 0;
  double lift_mm = 0;
  std::string aim_id = "a0";
  friend bool operator==(const StageTarget&, const StageTarget&) = default;
};

// How much a fault weighs. `invalid`: the position itself cannot be trusted.
enum class Alarm { none, minor, major, invalid };

constexpr std::string_view NameOf(Alarm alarm) {
  constexpr std::string_view names[] = {"none", "minor", "major", "invalid"};
  return names[static_cast<int>(alarm)];
}

enum class AxisState { unpowered, unreferenced, idle, moving, held, fault };

struct HomeReport {
  int reference_epoch = 0;  // counts homings, from 1
  StagePosition position;
};

struct MoveReport {
  StagePosition position;
  std::int64_t settled_mono_ns = 0;  // exposures that begin after this instant are sharp
};

struct MotionStatus {
  AxisState turntable = AxisState::unreferenced;
  AxisState lift = AxisState::unreferenced;
  int reference_epoch = 0;
  StagePosition position;
  std::string fault;          // empty when none
  Alarm alarm = Alarm::none;  // the worst of the interlocks that are up
  std::string interlocks;     // their names; empty when none
};

// Thread contract: Home and MoveTo from one thread at a time; Stop, Abort, LoseHeartbeat,
// Acknowledge, ReadStatus from any thread, also while a move runs. A requested stop token acts like
// Stop(). Errors: device faults (limits, lost reference, heartbeat), cancelled after Stop.
class Motion {
 public:
  virtual ~Motion() = default;
  virtual Result<HomeReport> Home(std::stop_token stop) = 0;
  // Moves all axes together and returns when they have settled. A target outside the limits is
  // refused before anything moves. Needs a homed stage.
  virtual Result<MoveReport> MoveTo(const StageTarget& target, std::stop_token stop) = 0;
  // Ramps down; the position stays known.
  virtual Status Stop() = 0;
  // Edges cease at once; the position is unknown and only homing clears it.
  virtual Status Abort() = 0;
  // Whoever asked for the motion that runs has died or fallen silent. Call before its stop token is
  // requested, so that the alarm says why.
  virtual Status LoseHeartbeat() { return Stop(); }
  // A person has seen the latched alarms; those whose cause is gone go down.
  virtual Status Acknowledge() { return {}; }
  virtual MotionStatus ReadStatus() = 0;
};

}  // namespace scan
