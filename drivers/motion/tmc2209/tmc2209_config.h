// How a TMC2209 stepper driver is set up over its serial line.
#pragma once

#include <string>

namespace scan {

struct Tmc2209Config {
  std::string port;          // of the serial line ("/dev/ttyAMA0"); empty: the axis has none
  int address = 0;           // 0 to 3, by the pins MS1 and MS2; up to four drivers share a line
  int microsteps = 16;       // 1 to 256, a power of two
  double run_ma = 500;       // motor current, RMS
  double hold_ma = 250;      // at rest
  double sense_mohm = 110;   // sense resistors of the board
  bool stealth_chop = true;  // quiet; else SpreadCycle, for torque at speed
  int stall_threshold = 0;   // 1 to 255: a stall shows on DIAG while homing (SGTHRS); 0: never
  friend bool operator==(const Tmc2209Config&, const Tmc2209Config&) = default;
};

}  // namespace scan
