#include "firmware-host/cli/still_files.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>

#include "drivers/base/files.h"

namespace scan {
namespace {

Json StillJson(const Frame& frame) {
  Json still = {{"paths", Json::array()},
                {"sensor_sequence", frame.sensor_sequence},
                {"exposure_not_before_ns", frame.exposure.not_before_ns},
                {"exposure_not_after_ns", frame.exposure.not_after_ns},
                {"sensor_timestamp", frame.exposure.source == ExposureSource::sensor},
                {"hot_shoe", frame.exposure.source == ExposureSource::hot_shoe}};
  if (frame.applied.exposure_us) still["exposure_us"] = *frame.applied.exposure_us;
  if (frame.applied.gain) still["gain"] = *frame.applied.gain;
  return still;
}

std::string Told(const std::optional<double>& value, const char* unit) {
  return value ? fmt::format("{:g}{}", *value, unit) : "not reported";
}

}  // namespace

void AddStillOptions(CLI::App& grab, StillOptions& options) {
  grab.add_option("--out", options.out, "picture file; the extension is the camera's choice")
      ->required();
  grab.add_option("--exposure-us", options.exposure_us, "exposure time; default as it is")
      ->check(Positive());
  grab.add_option("--count", options.count, "so many stills")->check(CLI::Range(1, 10'000));
  grab.add_flag("--force", options.force, "overwrite files");
}

Result<CommandOutput> TakeStills(Camera& camera, const StillOptions& options,
                                 std::stop_token stop) {
  CameraSettings settings;
  if (options.exposure_us > 0) settings.exposure_us = options.exposure_us;
  if (options.gain > 0) settings.gain = options.gain;
  SCAN_CHECK(camera.Configure(settings));
  CommandOutput output{{{"camera", camera.Info().model}, {"stills", Json::array()}}, ""};
  for (int i = 1; i <= options.count; ++i) {
    SCAN_TRY(const Frame frame, camera.Grab(stop));
    Json still = StillJson(frame);
    for (const EncodedFile& file : frame.files) {
      std::filesystem::path path = options.out;
      if (options.count > 1)
        path.replace_filename(fmt::format("{}-{}", options.out.stem().string(), i));
      path.replace_extension(file.extension);
      SCAN_CHECK(PrepareOutputFile(path, options.force));
      SCAN_CHECK(WriteFileDurably(path, file.bytes));
      still["paths"].push_back(path.string());
      output.text += fmt::format(
          "{}: {} x {}, exposure {}, gain {}\n", path.string(), camera.Info().w, camera.Info().h,
          Told(frame.applied.exposure_us, " us"), Told(frame.applied.gain, ""));
    }
    output.json["stills"].push_back(std::move(still));
  }
  return output;
}

Result<std::pair<int, int>> ReadSize(const std::string& text) {
  int width = 0, height = 0;
  const char* end = text.data() + text.size();
  const auto w = std::from_chars(text.data(), end, width);
  const bool has_x = w.ec == std::errc() && w.ptr != end && *w.ptr == 'x';
  const auto h = has_x ? std::from_chars(w.ptr + 1, end, height) : w;
  if (has_x && h.ec == std::errc() && h.ptr == end && width > 0 && height > 0)
    return std::pair(width, height);
  return BadInput(fmt::format("'{}' is no size", text), "--size", "write WIDTHxHEIGHT, in pixels");
}

Result<std::pair<std::string, std::string>> SplitAssignment(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    return BadInput(fmt::format("'{}' sets nothing", text), "device", "write NAME=VALUE");
  return std::pair(text.substr(0, equals), text.substr(equals + 1));
}

}  // namespace scan
