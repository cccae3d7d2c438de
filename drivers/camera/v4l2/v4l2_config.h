// The V4L2 part of a camera's configuration, as its station file says it ([camera.v4l2]).
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace scan {

struct V4l2Config {
  std::string port;              // where it is plugged in; empty: any
  std::string name;              // as the driver calls it; empty: any
  std::string pixel_format;      // MJPG YUYV ...; empty: the best of the size
  double frame_interval_ms = 0;  // 0: as the camera has it
  bool lock_automatics = true;   // exposure, gain, white balance, focus, hue: off before the rest
  std::map<std::string, std::string> controls;  // by name; a number, true, false or a menu entry
  double unity_gain = 0;       // value of the control gain that means gain 1; 0: gain is not driven
  int latency_frames = 1;      // frames that the camera may hold back before it sends one
  int settings_frames = 2;     // further frames dropped after a control was changed
  double timeout_ms = 2000;    // without any frame: the stream is restarted, then it is a fault
  double reconnect_ms = 3000;  // how long a camera that is gone is waited for
  friend bool operator==(const V4l2Config&, const V4l2Config&) = default;
};

}  // namespace scan
