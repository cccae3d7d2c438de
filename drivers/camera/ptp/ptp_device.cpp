#include "drivers/camera/ptp/ptp_device.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>

#include "drivers/camera/ptp/photo_choices.h"
#include "drivers/camera/ptp/usb_holders.h"

namespace scan {
namespace {

constexpr std::int64_t kLeastFreeKb = 100'000;  // of a card that counts no pictures: one or two

std::string MendFor(PhotoFaultKind kind) {
  switch (kind) {
    case PhotoFaultKind::gone:
      return "switch the camera on and plug it in at the same port; its own timer must not switch "
             "it off";
    case PhotoFaultKind::claimed:
      return "end the other program that uses the camera";
    case PhotoFaultKind::not_permitted:
      return "copy udev/60-scanstation.rules to /etc/udev/rules.d, run 'udevadm control --reload', "
             "add this user to the group plugdev, log in anew and plug the camera in again";
    case PhotoFaultKind::busy:
      return "wait until the camera has written its pictures, leave its menus and its play-back";
    case PhotoFaultKind::timeout:
      return "switch the camera off and on; a direct cable instead of a hub may help";
    case PhotoFaultKind::unsupported:
      return "choose a camera that libgphoto2 can release over USB, or set it to PTP (PC remote)";
    case PhotoFaultKind::no_space:
      return "empty the camera's card, or set camera.ptp.target = \"ram\"";
    case PhotoFaultKind::refused:
      return "set camera and lens to manual focus and manual exposure, and look at its display";
    case PhotoFaultKind::transfer:
      break;
  }
  return "check the cable and switch the camera off and on";
}

bool Fits(const PhotoDevice& device, const PtpConfig& config) {
  return (config.port.empty() || device.port == config.port) &&
         (config.serial.empty() || device.serial == config.serial) &&
         (config.model.empty() || device.model == config.model);
}

}  // namespace

std::string Describe(const PhotoDevice& device) {
  return fmt::format("{} at port {}", device.model, device.port.empty() ? "?" : device.port);
}

Error PtpError(const PhotoFault& fault, const std::string& where,
               std::span<const std::string> competitors) {
  Error error{ErrorKind::device, fault.what, where, MendFor(fault.kind)};
  if (fault.kind == PhotoFaultKind::claimed && !competitors.empty()) {
    error.what += fmt::format("; it is held by {}", fmt::join(competitors, ", "));
    error.mend =
        std::any_of(competitors.begin(), competitors.end(), IsDesktopService)
            ? "end the desktop's camera service: systemctl --user mask --now "
              "gvfs-gphoto2-volume-monitor.service; gio mount -s gphoto2; then plug the camera in "
              "again"
            : "end that program";
  }
  return error;
}

Result<PhotoDevice> FindPhotoDevice(std::span<const PhotoDevice> devices, const PtpConfig& config) {
  std::vector<const PhotoDevice*> found;
  std::vector<std::string> there;
  for (const PhotoDevice& device : devices) {
    if (Fits(device, config)) found.push_back(&device);
    there.push_back(Describe(device));
  }
  if (found.size() == 1) return *found.front();
  const std::string asked =
      fmt::format("port '{}', serial '{}', model '{}'", config.port, config.serial, config.model);
  const std::string list =
      there.empty() ? "none is connected" : fmt::format("connected: {}", fmt::join(there, "; "));
  if (found.empty())
    return DeviceFault("no such still camera; " + list, asked,
                       "switch the camera on and set its USB mode to PTP; 'scanstation device ptp "
                       "list' shows what is there");
  return BadInput("several still cameras fit; " + list, asked,
                  "name the port, or the serial number");
}

Result<std::unique_ptr<PhotoCamera>> OpenPhotoDevice(PhotoSystem& system,
                                                     const PhotoDevice& device) {
  const std::string where = Describe(device);
  auto camera = system.Open(device);
  if (!camera) {
    std::vector<std::string> competitors;
    if (camera.error().kind == PhotoFaultKind::claimed) competitors = system.Competitors(device);
    return tl::unexpected(PtpError(camera.error(), where, competitors));
  }
  const PhotoAbilities abilities = (*camera)->Abilities();
  if (!abilities.capture && !abilities.trigger)
    return tl::unexpected(
        PtpError({PhotoFaultKind::unsupported, "the camera cannot be released over USB"}, where));
  return std::move(*camera);
}

Result<PtpReadiness> ReadReadiness(PhotoCamera& camera, const std::string& where) {
  PtpReadiness ready;
  const auto names =
      camera.Abilities().settings ? camera.SettingNames() : PhotoResult<std::vector<std::string>>();
  if (!names) return tl::unexpected(PtpError(names.error(), where));
  for (const std::string& name : *names) {
    if (name != "batterylevel" && name != "availableshots") continue;
    const auto setting = camera.Get(name);
    if (!setting) return tl::unexpected(PtpError(setting.error(), where));
    if (name == "batterylevel")
      ready.battery_percent = BatteryPercentOf(setting->value).value_or(-1);
    // Of the memory that is in use as target: the card's own count below is better.
    std::int64_t shots = -1;
    const std::string& text = setting->value;
    if (name == "availableshots" &&
        std::from_chars(text.data(), text.data() + text.size(), shots).ec == std::errc())
      ready.shots_left = shots;
  }
  const auto storage = camera.Storage();
  if (!storage) {
    if (storage.error().kind == PhotoFaultKind::unsupported) return ready;
    return tl::unexpected(PtpError(storage.error(), where));
  }
  std::int64_t images = -1, free_kb = -1;
  for (const PhotoStorage& card : *storage) {
    if (!card.writable) continue;
    if (card.free_images >= 0) images = std::max<std::int64_t>(images, 0) + card.free_images;
    if (card.free_kb >= 0) free_kb = std::max<std::int64_t>(free_kb, 0) + card.free_kb;
  }
  if (images >= 0) ready.shots_left = images;
  if (ready.shots_left < 0 && free_kb >= 0 && free_kb < kLeastFreeKb) ready.shots_left = 0;
  if (storage->empty() && ready.shots_left < 0) ready.shots_left = 0;  // no card
  return ready;
}

Status CheckReadiness(const PtpReadiness& readiness, const PtpConfig& config, bool onto_card,
                      const std::string& where) {
  if (readiness.battery_percent >= 0 && readiness.battery_percent < config.min_battery_percent)
    return DeviceFault(
        fmt::format("the camera's battery has {:g} % left", readiness.battery_percent), where,
        "charge it, or use a mains adapter; camera.ptp.min_battery_percent is the "
        "bound");
  if (onto_card && readiness.shots_left >= 0 && readiness.shots_left < config.min_shots)
    return DeviceFault(
        fmt::format("the camera's card has room for {} pictures", readiness.shots_left), where,
        "empty the card, or set camera.ptp.target = \"ram\"; camera.ptp.min_shots is the bound");
  return {};
}

}  // namespace scan
