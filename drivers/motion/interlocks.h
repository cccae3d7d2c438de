// The interlocks of a station: which are up, what they forbid, what a person has acknowledged.
#pragma once

#include <array>
#include <string>

#include "drivers/base/result.h"
#include "drivers/motion/axis_table.h"

namespace scan {

// Follows kInterlockTable. Thread contract: one thread at a time (the owner locks).
class Interlocks {
 public:
  void Raise(Interlock interlock);
  void CauseGone(Interlock interlock);
  // By a person. A cause that is still present keeps its alarm up.
  void Acknowledge();
  // A homing mends what only made the position doubtful: the latched interlocks that permit homing.
  void Homed();

  bool IsUp(Interlock interlock) const;
  Alarm alarm() const;        // the worst
  std::string Words() const;  // "emergency stop, cover open"; empty when none is up
  // Errors: device, naming the interlock that forbids the command and what clears it.
  Status Permit(AxisCommand command) const;

 private:
  std::array<AlarmLatch, kInterlocks> latches_;
};

}  // namespace scan
