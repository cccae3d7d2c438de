#include "drivers/camera/ptp/ptp_settings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <charconv>

#include "drivers/base/durations.h"
#include "drivers/camera/ptp/photo_choices.h"
#include "drivers/camera/ptp/ptp_device.h"

namespace scan {
namespace {

constexpr double kTolerance = 0.01;  // marked speeds are rounded: 1/60 is asked for as 16667 us
constexpr int kPollMs = 50;
constexpr std::size_t kShownChoices = 40;

std::string Lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool SameValue(const std::string& a, const std::string& b) {
  if (a == b) return true;
  const auto number = [](const std::string& text, double& value) {
    const auto [at, code] = std::from_chars(text.data(), text.data() + text.size(), value);
    return code == std::errc() && at == text.data() + text.size();
  };
  double x = 0, y = 0;  // a range says 2.000000 for 2
  return number(a, x) && number(b, y) && x == y;
}

std::string ChoicesOf(const PhotoSetting& setting) {
  if (setting.read_only) return "it can only be set on the camera itself";
  if (setting.choices.empty()) return "see 'scanstation device ptp get'";
  const auto end = setting.choices.begin() +
                   static_cast<std::ptrdiff_t>(std::min(setting.choices.size(), kShownChoices));
  return fmt::format("choose one of: {}", fmt::join(setting.choices.begin(), end, ", "));
}

bool HasChoice(const PhotoSetting& setting, const std::string& value) {
  return std::find(setting.choices.begin(), setting.choices.end(), value) != setting.choices.end();
}

}  // namespace

bool PtpSettings::Has(const std::string& name) const {
  return std::find(names_.begin(), names_.end(), name) != names_.end();
}

std::string PtpSettings::FirstOf(std::initializer_list<const char*> names) const {
  for (const char* name : names) {
    if (Has(name)) return name;
  }
  return "";
}

Result<PhotoSetting> PtpSettings::Get(PhotoCamera& camera, const std::string& name) const {
  auto setting = camera.Get(name);
  if (!setting) return tl::unexpected(PtpError(setting.error(), where_ + ", " + name));
  return std::move(*setting);
}

Result<PtpSettings> PtpSettings::Plan(PhotoCamera& camera, const PtpConfig& config,
                                      const CameraSettings& asked, const std::string& where) {
  PtpSettings plan(config, where);
  if (camera.Abilities().settings) {
    auto names = camera.SettingNames();
    if (!names) return tl::unexpected(PtpError(names.error(), where));
    plan.names_ = std::move(*names);
  }
  // shutterspeed2 names fractions where shutterspeed has decimals cut off (Nikon).
  plan.exposure_name_ = plan.FirstOf({"shutterspeed2", "shutterspeed"});
  plan.iso_name_ = plan.FirstOf({"iso"});
  SCAN_CHECK(plan.PlanPicture(camera));
  SCAN_CHECK(plan.PlanExposure(camera, asked));
  SCAN_CHECK(plan.PlanFurther(camera));
  return plan;
}

Status PtpSettings::PlanExposure(PhotoCamera& camera, const CameraSettings& asked) {
  if (asked.exposure_us) {
    if (exposure_name_.empty())
      return BadInput("the exposure of this camera cannot be set over USB", where_,
                      "set it on the camera and leave exposure_us out");
    SCAN_TRY(const PhotoSetting setting, Get(camera, exposure_name_));
    SCAN_TRY(std::string value, NearestChoice(setting.choices, ExposureUsOf, *asked.exposure_us,
                                              kTolerance, "exposure", "us"));
    held_.push_back({exposure_name_, std::move(value)});
    exposure_driven_ = true;
  }
  if (asked.gain && config_.base_iso > 0) {
    if (iso_name_.empty())
      return BadInput("the ISO speed of this camera cannot be set over USB", where_,
                      "set it on the camera, and camera.ptp.base_iso = 0");
    SCAN_TRY(const PhotoSetting setting, Get(camera, iso_name_));
    SCAN_TRY(std::string value,
             NearestChoice(setting.choices, IsoOf, *asked.gain * config_.base_iso, kTolerance,
                           "speed", "ISO"));
    // Automatic ISO (Nikon) would change what was set.
    if (Has("isoauto")) {
      SCAN_TRY(const PhotoSetting automatic, Get(camera, "isoauto"));
      if (HasChoice(automatic, "Off")) held_.push_back({"isoauto", "Off"});
    }
    held_.push_back({iso_name_, std::move(value)});
  }
  if (config_.f_number > 0) {
    const std::string name = FirstOf({"f-number", "aperture"});
    if (name.empty())
      return BadInput("the aperture of this camera cannot be set over USB", where_,
                      "set it on the lens, and camera.ptp.f_number = 0");
    SCAN_TRY(const PhotoSetting setting, Get(camera, name));
    SCAN_TRY(std::string value, NearestChoice(setting.choices, FNumberOf, config_.f_number,
                                              kTolerance, "aperture", "f-number"));
    held_.push_back({name, std::move(value)});
  }
  return {};
}

Status PtpSettings::PlanPicture(PhotoCamera& camera) {
  if (!config_.target.empty()) {
    if (!Has("capturetarget")) {
      if (config_.target == "ram")
        return BadInput("the camera keeps every picture on its card", where_ + ", capturetarget",
                        "set camera.ptp.target = \"card\"");
    } else {
      SCAN_TRY(const PhotoSetting setting, Get(camera, "capturetarget"));
      const auto found = std::find_if(
          setting.choices.begin(), setting.choices.end(), [&](const std::string& choice) {
            const std::string word = Lower(choice);  // "Internal RAM", "sdram"; "Memory card"
            return word.find(config_.target) != std::string::npos &&
                   word.find('+') == std::string::npos;
          });
      if (found == setting.choices.end())
        return BadInput(fmt::format("pictures cannot be kept in '{}'", config_.target),
                        where_ + ", capturetarget", ChoicesOf(setting));
      held_.push_back({"capturetarget", *found});
      into_ram_ = config_.target == "ram";
    }
  }
  std::string quality;
  for (const char* name : {"imageformat", "imagequality"}) {
    if (!Has(name)) continue;
    SCAN_TRY(const PhotoSetting setting, Get(camera, name));
    const bool wanted = !config_.quality.empty() && HasChoice(setting, config_.quality);
    if (wanted) held_.push_back({name, config_.quality});
    if (quality.empty() || wanted) quality = wanted ? config_.quality : setting.value;
    if (wanted) break;
  }
  if (!config_.quality.empty() && quality != config_.quality)
    return BadInput(fmt::format("the camera has no picture quality '{}'", config_.quality), where_,
                    "'scanstation device ptp get imagequality imageformat' shows the choices");
  files_ = config_.files > 0 ? config_.files : quality.find('+') != std::string::npos ? 2 : 1;
  return {};
}

Status PtpSettings::PlanFurther(PhotoCamera& camera) {
  for (const auto& [name, value] : config_.settings) {
    if (!Has(name))
      return BadInput(fmt::format("the camera has no setting '{}'", name), where_,
                      "'scanstation device ptp get' lists them");
    SCAN_TRY(const PhotoSetting setting, Get(camera, name));
    if (!setting.choices.empty() && !HasChoice(setting, value))
      return BadInput(fmt::format("{} cannot be '{}'", name, value), where_, ChoicesOf(setting));
    held_.push_back({name, value});
  }
  return {};
}

Status PtpSettings::CheckManual(PhotoCamera& camera) const {
  const std::string mode =
      FirstOf({"expprogram", "autoexposuremodedial", "autoexposuremode", "shootingmode"});
  if (exposure_driven_ && !mode.empty()) {
    SCAN_TRY(const PhotoSetting setting, Get(camera, mode));
    const std::string value = Lower(setting.value);
    if (value != "m" && value != "manual")
      return DeviceFault(
          fmt::format("the camera chooses the exposure itself ({} is {})", mode, setting.value),
          where_, "turn its mode dial to M");
  }
  if (config_.manual_focus && Has("focusmode")) {
    SCAN_TRY(const PhotoSetting setting, Get(camera, "focusmode"));
    const std::string value = Lower(setting.value);
    if (value.find("manual") == std::string::npos && value != "mf" && value != "m")
      return DeviceFault(
          fmt::format("the camera focuses by itself (focusmode is {})", setting.value), where_,
          "switch the lens to manual focus, or set camera.ptp.manual_focus = false");
  }
  return {};
}

Status PtpSettings::HoldOne(PhotoCamera& camera, Clock& clock, const Pump& pump,
                            const Held& held) const {
  SCAN_TRY(PhotoSetting now, Get(camera, held.name));
  if (SameValue(now.value, held.value)) return {};
  const auto deadline_ns = clock.Now().mono_ns + NsOfMs(config_.settings_ms);
  bool sent = false;
  std::string refusal;
  do {
    if (!sent) {
      const PhotoStatus set = camera.Set(held.name, held.value);
      sent = set.has_value();
      // A camera that is still busy with the last picture takes it a little later.
      if (!set && set.error().kind != PhotoFaultKind::busy &&
          set.error().kind != PhotoFaultKind::refused)
        return tl::unexpected(PtpError(set.error(), where_ + ", " + held.name));
      if (!set) refusal = "; " + set.error().what;
    }
    if (const PhotoStatus pumped = pump(sent ? 0 : kPollMs); !pumped)
      return tl::unexpected(PtpError(pumped.error(), where_));
    SCAN_TRY(now, Get(camera, held.name));
    if (SameValue(now.value, held.value)) return {};
    if (const PhotoStatus pumped = pump(kPollMs); !pumped)
      return tl::unexpected(PtpError(pumped.error(), where_));
  } while (clock.Now().mono_ns < deadline_ns);
  return DeviceFault(fmt::format("the camera keeps {} at '{}' instead of '{}'{}", held.name,
                                 now.value, held.value, refusal),
                     where_, ChoicesOf(now));
}

Result<AppliedSettings> PtpSettings::Hold(PhotoCamera& camera, Clock& clock,
                                          const Pump& pump) const {
  SCAN_CHECK(CheckManual(camera));
  for (const Held& held : held_) SCAN_CHECK(HoldOne(camera, clock, pump, held));
  return Read(camera);
}

Result<AppliedSettings> PtpSettings::Read(PhotoCamera& camera) const {
  AppliedSettings applied;
  if (!exposure_name_.empty()) {
    SCAN_TRY(const PhotoSetting setting, Get(camera, exposure_name_));
    applied.exposure_us = ExposureUsOf(setting.value);
  }
  if (!iso_name_.empty() && config_.base_iso > 0) {
    SCAN_TRY(const PhotoSetting setting, Get(camera, iso_name_));
    if (const auto iso = IsoOf(setting.value)) applied.gain = *iso / config_.base_iso;
  }
  return applied;
}

}  // namespace scan
