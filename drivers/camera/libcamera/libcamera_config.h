// The libcamera part of a camera's configuration, as its station file says it ([camera.libcamera]).
#pragma once

#include <map>
#include <string>

namespace scan {

struct LibcameraConfig {
  std::string camera = {};        // its id or model, as listed; empty: the only one
  std::string role = "still";     // still viewfinder raw; a camera without stills gives viewfinder
  std::string pixel_format = {};  // MJPEG YUYV NV12 SRGGB10_CSI2P ...; empty: the best of the size
  bool lock_automatics = true;    // AeEnable = false with every request
  std::map<std::string, std::string> controls = {};  // by libcamera's name; a number, true or false
  int latency_frames = 1;      // frames that the camera may hold back before it stamps one
  int settings_frames = 2;     // dropped after a change, where no metadata say what applied
  double timeout_ms = 2000;    // without any frame it is a fault
  double reconnect_ms = 3000;  // how long a camera that is gone is waited for
  friend bool operator==(const LibcameraConfig&, const LibcameraConfig&) = default;
};

}  // namespace scan
