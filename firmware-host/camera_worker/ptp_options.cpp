#include "firmware-host/camera_worker/ptp_options.h"

#include "firmware-host/camera_worker/options_text.h"

namespace scan {
namespace {

constexpr auto kPtpFields = [](auto& options, auto visit) {
  visit("id", options.id);
  visit("w", options.w);
  visit("h", options.h);
  auto& config = options.config;
  visit("port", config.port);
  visit("serial", config.serial);
  visit("model", config.model);
  visit("target", config.target);
  visit("quality", config.quality);
  visit("f_number", config.f_number);
  visit("base_iso", config.base_iso);
  visit("files", config.files);
  visit("delete_from_card", config.delete_from_card);
  visit("manual_focus", config.manual_focus);
  visit("min_battery_percent", config.min_battery_percent);
  visit("min_shots", config.min_shots);
  visit("settings_ms", config.settings_ms);
  visit("picture_ms", config.picture_ms);
  visit("pair_ms", config.pair_ms);
  visit("reconnect_ms", config.reconnect_ms);
  visit("gpio_chip", config.gpio_chip);
  visit("release_line", config.release_line);
  visit("release_active_low", config.release_active_low);
  visit("release_ms", config.release_ms);
  visit("hot_shoe_line", config.hot_shoe_line);
  visit("hot_shoe_active_low", config.hot_shoe_active_low);
  visit("curtain_ms", config.curtain_ms);
  visit("settings", config.settings);
};

}  // namespace

std::string ToWorkerOptions(const PtpCameraOptions& options) {
  return OptionsText(options, kPtpFields);
}

Result<PtpCameraOptions> PtpOptionsFrom(const std::string& text) {
  return OptionsFromText<PtpCameraOptions>(text, kPtpFields);
}

}  // namespace scan
