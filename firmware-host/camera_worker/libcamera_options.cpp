#include "firmware-host/camera_worker/libcamera_options.h"

#include <nlohmann/json.hpp>

namespace scan {

using Json = nlohmann::json;

std::string ToWorkerOptions(const LibcameraOptions& options) {
  const LibcameraConfig& config = options.config;
  return Json{{"id", options.id},
              {"w", options.w},
              {"h", options.h},
              {"camera", config.camera},
              {"role", config.role},
              {"pixel_format", config.pixel_format},
              {"lock_automatics", config.lock_automatics},
              {"controls", config.controls},
              {"latency_frames", config.latency_frames},
              {"settings_frames", config.settings_frames},
              {"timeout_ms", config.timeout_ms},
              {"reconnect_ms", config.reconnect_ms}}
      .dump();
}

Result<LibcameraOptions> LibcameraOptionsFrom(const std::string& text) {
  try {
    const Json json = Json::parse(text);
    LibcameraOptions options;
    LibcameraConfig& config = options.config;
    json.at("id").get_to(options.id);
    json.at("w").get_to(options.w);
    json.at("h").get_to(options.h);
    json.at("camera").get_to(config.camera);
    json.at("role").get_to(config.role);
    json.at("pixel_format").get_to(config.pixel_format);
    json.at("lock_automatics").get_to(config.lock_automatics);
    json.at("controls").get_to(config.controls);
    json.at("latency_frames").get_to(config.latency_frames);
    json.at("settings_frames").get_to(config.settings_frames);
    json.at("timeout_ms").get_to(config.timeout_ms);
    json.at("reconnect_ms").get_to(config.reconnect_ms);
    return options;
  } catch (const Json::exception& e) {
    return BadInput(std::string("malformed options (") + e.what() + ")", "camera worker",
                    "use programs of the same version");
  }
}

}  // namespace scan
