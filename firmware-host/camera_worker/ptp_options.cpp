#include "firmware-host/camera_worker/ptp_options.h"

#include <nlohmann/json.hpp>

namespace scan {
namespace {

using Json = nlohmann::json;

// Every field by name, for both directions.
template <class Options, class Visit>
void ForEachField(Options& options, Visit visit) {
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
}

}  // namespace

std::string ToWorkerOptions(const PtpCameraOptions& options) {
  Json json = Json::object();
  ForEachField(options, [&](const char* key, const auto& value) { json[key] = value; });
  return json.dump();
}

Result<PtpCameraOptions> PtpOptionsFrom(const std::string& text) {
  try {
    const Json json = Json::parse(text);
    PtpCameraOptions options;
    ForEachField(options, [&](const char* key, auto& value) { json.at(key).get_to(value); });
    return options;
  } catch (const Json::exception& e) {
    return BadInput(std::string("malformed options (") + e.what() + ")", "camera worker",
                    "use programs of the same version");
  }
}

}  // namespace scan
