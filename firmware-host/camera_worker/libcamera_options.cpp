#include "firmware-host/camera_worker/libcamera_options.h"

#include "firmware-host/camera_worker/options_text.h"

namespace scan {
namespace {

constexpr auto kLibcameraFields = [](auto& options, auto visit) {
  visit("id", options.id);
  visit("w", options.w);
  visit("h", options.h);
  auto& config = options.config;
  visit("camera", config.camera);
  visit("role", config.role);
  visit("pixel_format", config.pixel_format);
  visit("lock_automatics", config.lock_automatics);
  visit("controls", config.controls);
  visit("latency_frames", config.latency_frames);
  visit("settings_frames", config.settings_frames);
  visit("timeout_ms", config.timeout_ms);
  visit("reconnect_ms", config.reconnect_ms);
};

}  // namespace

std::string ToWorkerOptions(const LibcameraOptions& options) {
  return OptionsText(options, kLibcameraFields);
}

Result<LibcameraOptions> LibcameraOptionsFrom(const std::string& text) {
  return OptionsFromText<LibcameraOptions>(text, kLibcameraFields);
}

}  // namespace scan
