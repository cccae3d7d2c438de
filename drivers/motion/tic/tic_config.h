// Which Tic boards move a station.
#pragma once

#include <string>

namespace scan {

// At least one of serial and port is given; both must fit then.
struct TicAxisWiring {
  std::string serial;  // "00345678", as 'scanstation device tic list' shows it
  std::string port;    // "1-2.3"
  int microsteps = 0;  // per full step; 0: as the board is set
  friend bool operator==(const TicAxisWiring&, const TicAxisWiring&) = default;
};

struct TicMotionConfig {
  TicAxisWiring turntable, lift;
  double poll_ms = 5;  // how often a board that moves is asked where it is
  friend bool operator==(const TicMotionConfig&, const TicMotionConfig&) = default;
};

}  // namespace scan
