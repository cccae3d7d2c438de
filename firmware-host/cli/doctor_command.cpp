// scanstation doctor: what this machine has for a station's devices, what it lacks, how to mend it.
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>

#include "drivers/camera/v4l2/kernel_v4l2.h"
#include "drivers/camera/v4l2/v4l2_device.h"
#include "drivers/io/gpio/gpiod_lines.h"
#include "drivers/io/pwm/pwm_lamp.h"
#include "drivers/motion/real_time.h"
#include "drivers/motion/tic/tic_protocol.h"
#include "drivers/station/station_file.h"
#include "drivers/usb/libusb_bus.h"
#include "drivers/usb/usb_access.h"
#include "firmware-host/cli/commands.h"
#include "firmware-host/devices/open_libcamera.h"
#include "firmware-host/devices/open_ptp.h"

namespace scan {
namespace {

enum class Verdict { good, hint, bad };

struct Finding {
  Verdict verdict = Verdict::good;
  std::string subject, what, mend;
};

// Without how to mend it, which a finding says by itself.
std::string WhatAndWhere(const Error& error) {
  return error.where.empty() ? error.what : fmt::format("{}: {}", error.what, error.where);
}

constexpr const char* kVerdictNames[] = {"good", "hint", "bad"};

void CheckChips(std::vector<Finding>& findings, bool needed) {
  const auto chips = ListGpiodChips();
  std::string labels;
  for (const GpioChipInfo& chip : chips) labels += (labels.empty() ? "" : ", ") + chip.label;
  if (!chips.empty()) {
    findings.push_back(
        {Verdict::good, "gpio", fmt::format("libgpiod {}; chips: {}", GpiodVersion(), labels), ""});
    return;
  }
  findings.push_back(
      {needed ? Verdict::bad : Verdict::hint, "gpio",
       fmt::format("libgpiod {}; no chip that this user may open", GpiodVersion()),
       "add this user to the group that owns /dev/gpiochip* (gpio), or use a station "
       "without GPIO"});
}

std::vector<GpioPin> PinsOf(const GpioMotionConfig& gpio) {
  std::vector<GpioPin> pins{gpio.emergency_stop, gpio.cover, gpio.motor_power};
  for (const GpioAxisWiring* axis : {&gpio.turntable, &gpio.lift}) {
    for (const GpioPin& pin :
         {axis->step, axis->direction, axis->enable, axis->brake, axis->endstop, axis->index}) {
      pins.push_back(pin);
    }
  }
  std::erase_if(pins, [](const GpioPin& pin) { return !pin; });
  return pins;
}

// Looks only: a line that is taken may well be held by the running scanstation-motiond.
void CheckLines(std::vector<Finding>& findings, const GpioMotionConfig& gpio) {
  GpioRequest request{gpio.chip, "", {}};
  for (const GpioPin& pin : PinsOf(gpio)) request.lines.push_back({pin.name});
  const auto chips = ListGpiodChips();
  const auto place = FindGpioLines(chips, request);
  if (!place) {
    findings.push_back({Verdict::bad, "lines", WhatAndWhere(place.error()), place.error().mend});
    return;
  }
  const GpioChipInfo& chip = chips[place->chip];
  findings.push_back({Verdict::good, "lines",
                      fmt::format("all {} lines are on {}", request.lines.size(), chip.label), ""});
  for (std::size_t k = 0; k < place->offsets.size(); ++k) {
    const GpioLineInfo& line = chip.lines[place->offsets[k]];
    if (!line.used || line.consumer.starts_with("scanstation")) continue;
    findings.push_back({Verdict::bad, "lines",
                        fmt::format("{} is held by '{}'", request.lines[k].name, line.consumer),
                        "end that program, or free the pin from its function"});
  }
}

// Raspberry Pi kernels keep driving lines whose program has died, unless told otherwise.
void CheckRelease(std::vector<Finding>& findings) {
  for (const char* driver : {"pinctrl_rp1", "pinctrl_bcm2835"}) {
    std::ifstream in(fmt::format("/sys/module/{}/parameters/persist_gpio_outputs", driver));
    char kept = 0;
    if (!(in >> kept)) continue;
    if (kept == 'Y' || kept == '1') {
      findings.push_back({Verdict::hint, "lines after exit",
                          "the kernel keeps driving lines whose program has died: motors stay "
                          "energised then",
                          "add dtparam=strict_gpiod to config.txt and wire pull-ups to the enable "
                          "lines, or make sure that energised motors do no harm"});
    } else {
      findings.push_back({Verdict::good, "lines after exit", "released to their pull", ""});
    }
  }
}

void CheckRealTime(std::vector<Finding>& findings, const RealTimeOptions& options) {
  if (options.core && *options.core >= static_cast<int>(std::thread::hardware_concurrency())) {
    findings.push_back({Verdict::bad, "real time",
                        fmt::format("there is no core {}", *options.core),
                        "choose another motion.core"});
  }
  if (options.priority == 0) {
    findings.push_back({Verdict::hint, "real time",
                        "switched off: steps come late on a busy machine",
                        "set motion.priority to 50"});
    return;
  }
  RealTimeGrant grant;
  RealTimeOptions trial = options;
  trial.core.reset();
  std::thread([&] { grant = BecomeRealTime(trial); }).join();
  if (grant.mend.empty()) {
    findings.push_back({Verdict::good, "real time", "scheduling and locked memory granted", ""});
  } else {
    findings.push_back({Verdict::hint, "real time", "not granted to this user", grant.mend});
  }
}

std::string Text(const UsbIdentity& board) {
  return fmt::format("{}, firmware {:x}.{:02x}", Describe(board), board.release >> 8,
                     board.release & 0xff);
}

// Every board that is there; and, of a station that has them, the boards of its axes.
void CheckTics(std::vector<Finding>& findings, const StationConfig& config) {
  const bool needed = config.motion_driver == MotionDriver::tic;
  const auto add_error = [&](const Error& error) {
    findings.push_back(
        {needed ? Verdict::bad : Verdict::hint, "USB", WhatAndWhere(error), error.mend});
  };
  const auto bus = MakeLibusbBus();
  if (!bus) return add_error(bus.error());
  const auto devices = (*bus)->List();
  if (!devices) return add_error(devices.error());
  int boards = 0;
  for (const UsbIdentity& board : *devices) {
    if (!FindTicModel(board.vendor, board.product)) continue;
    ++boards;
    if (const Status access = CheckUsbAccess(board); !access) {
      findings.push_back({needed ? Verdict::bad : Verdict::hint, "Tic board",
                          Text(board) + ": not permitted to this user", access.error().mend});
    } else if (board.release < kTicLeastFirmware) {
      findings.push_back({needed ? Verdict::bad : Verdict::hint, "Tic board",
                          Text(board) + ": too old for limit switches and homing",
                          "upgrade it to 1.06 or later (Pololu's guide, section 5.7)"});
    } else {
      findings.push_back({Verdict::good, "Tic board", Text(board), ""});
    }
  }
  if (!needed) {
    if (boards == 0) findings.push_back({Verdict::good, "Tic board", "none is connected", ""});
    return;
  }
  for (const auto& [axis, wiring] :
       {std::pair("turntable", &config.tic.turntable), std::pair("lift", &config.tic.lift)}) {
    const auto found = FindUsb(*devices, TicSelector(wiring->port, wiring->serial), "Tic board");
    if (found) {
      findings.push_back({Verdict::good, axis, "is moved by " + Describe(*found), ""});
    } else {
      findings.push_back({Verdict::bad, axis, found.error().what, found.error().mend});
    }
  }
}

// The kernel's cameras; and, of a station that uses them, its own. One that is streaming may be
// opened for a look.
void CheckKernelCameras(std::vector<Finding>& findings, const StationConfig& config) {
  const auto system = std::make_shared<KernelV4l2>();
  std::string names;
  for (const VideoNode& node : ListCaptureNodes(system))
    names += fmt::format("{}{} at {}", names.empty() ? "" : ", ", node.name, node.port);
  findings.push_back({Verdict::good, "V4L2",
                      names.empty() ? "no camera that this user may open" : "finds " + names, ""});
  for (const CameraConfig& camera : config.cameras) {
    if (camera.driver != CameraDriver::v4l2) continue;
    const auto found = OpenSelected(system, {camera.v4l2.port, camera.v4l2.name});
    if (found) {
      findings.push_back({Verdict::good, "camera " + camera.id, "is " + (*found)->Where(), ""});
    } else {
      findings.push_back(
          {Verdict::bad, "camera " + camera.id, found.error().what, found.error().mend});
    }
  }
}

// What libcamera finds; and, of a station that uses it, its cameras.
void CheckLibcamera(std::vector<Finding>& findings, const StationConfig& config) {
  const auto uses = [](const CameraConfig& camera) {
    return camera.driver == CameraDriver::libcamera;
  };
  const bool needed = std::any_of(config.cameras.begin(), config.cameras.end(), uses);
  const auto listed = ListLibcameras();
  if (!listed) {
    findings.push_back({needed ? Verdict::bad : Verdict::hint, "libcamera",
                        WhatAndWhere(listed.error()), listed.error().mend});
    return;
  }
  std::vector<LibcameraEntry> cameras;
  std::string names;
  for (const CameraListing& camera : *listed) {
    cameras.push_back({camera.id, camera.model});
    names += (names.empty() ? "" : ", ") + camera.model;
  }
  findings.push_back({Verdict::good, "libcamera",
                      names.empty() ? "its worker runs; it finds no camera" : "finds " + names,
                      ""});
  for (const CameraConfig& camera : config.cameras) {
    if (!uses(camera)) continue;
    const auto found = FindLibcamera(cameras, camera.libcamera.camera);
    const Verdict verdict = found ? Verdict::good : Verdict::bad;
    findings.push_back({verdict, "camera " + camera.id,
                        found ? "is " + found->model : found.error().what,
                        found ? "" : found.error().mend});
  }
}

// Still cameras, through their worker: asked only where the station has one.
void CheckStillCameras(std::vector<Finding>& findings, const StationConfig& config) {
  for (const CameraConfig& camera : config.cameras) {
    if (camera.driver != CameraDriver::ptp) continue;
    const std::string subject = "camera " + camera.id;
    const auto info = AskPtp("info", camera.ptp, {});
    if (!info) {
      findings.push_back({Verdict::bad, subject, WhatAndWhere(info.error()), info.error().mend});
      continue;
    }
    const double battery_percent = info->value("battery_percent", -1.0);
    findings.push_back({Verdict::good, subject,
                        fmt::format("{} at port {}, battery {}", info->value("camera", ""),
                                    info->value("port", ""),
                                    battery_percent < 0 ? std::string("not reported")
                                                        : fmt::format("{:g} %", battery_percent)),
                        ""});
    if (battery_percent >= 0 && battery_percent < camera.ptp.min_battery_percent)
      findings.push_back({Verdict::bad, subject, "its battery is low", "charge it"});
    for (const auto& program : info->value("competitors", std::vector<std::string>()))
      findings.push_back({Verdict::hint, subject, program + " takes cameras that are plugged in",
                          "end it; of a desktop: systemctl --user mask --now "
                          "gvfs-gphoto2-volume-monitor.service"});
  }
}

// Whether the serial lines are there and permitted; scanstation-motiond may be using them.
void CheckSerialLines(std::vector<Finding>& findings, const StationConfig& config) {
  for (const auto& [axis, driver] : {std::pair("turntable", &config.turntable_tmc2209),
                                     std::pair("lift", &config.lift_tmc2209)}) {
    if (driver->port.empty()) continue;
    if (::access(driver->port.c_str(), R_OK | W_OK) == 0) {
      findings.push_back({Verdict::good, "TMC2209",
                          fmt::format("{}: address {} at {}", axis, driver->address, driver->port),
                          ""});
    } else {
      findings.push_back(
          {Verdict::bad, "TMC2209",
           fmt::format("{}: {}: {}", axis, driver->port, std::strerror(errno)),
           errno == EACCES ? "add this user to the group of that file (dialout)"
                           : "switch the serial line on (dtoverlay=uart0-pi5), or name another"});
    }
  }
}

// Looks only, as above.
void CheckLight(std::vector<Finding>& findings, const LightConfig& light) {
  if (light.driver == LightDriver::none) {
    findings.push_back({Verdict::good, "light", "the room's: the station has no lamp", ""});
  } else if (light.driver == LightDriver::gpio) {
    const auto chips = ListGpiodChips();
    const auto place = FindGpioLines(chips, {light.chip, "", {{light.line.name}}});
    if (!place) {
      findings.push_back({Verdict::bad, "light", WhatAndWhere(place.error()), place.error().mend});
      return;
    }
    const GpioChipInfo& chip = chips[place->chip];
    const GpioLineInfo& line = chip.lines[place->offsets[0]];
    if (line.used && !line.consumer.starts_with("scanstation")) {
      findings.push_back({Verdict::bad, "light",
                          fmt::format("{} is held by '{}'", light.line.name, line.consumer),
                          "end that program, or free the pin from its function"});
      return;
    }
    findings.push_back(
        {Verdict::good, "light", fmt::format("{} on {}", light.line.name, chip.label), ""});
  } else {
    const auto chip = FindPwmChip(*KernelPwmFiles(), light.chip);
    if (!chip) {
      findings.push_back({Verdict::bad, "light", chip.error().what, chip.error().mend});
    } else if (light.channel >= chip->channels) {
      findings.push_back({Verdict::bad, "light",
                          fmt::format("{} has {} channels", chip->device, chip->channels),
                          "choose another light.channel"});
    } else {
      findings.push_back({Verdict::good, "light",
                          fmt::format("channel {} of {}", light.channel, chip->device), ""});
    }
  }
}

Result<CommandOutput> RunDoctor(const std::filesystem::path& config_path) {
  std::vector<Finding> findings;
  StationConfig config;
  if (!config_path.empty()) {
    const auto read = LoadStationConfig(config_path);
    if (!read) {
      findings.push_back(
          {Verdict::bad, "station file", WhatAndWhere(read.error()), read.error().mend});
    } else {
      config = *read;
      findings.push_back({Verdict::good, "station file", config.name, ""});
    }
  }
  const bool gpio = config.motion_driver == MotionDriver::gpio;
  CheckChips(findings, gpio);
  if (gpio) {
    CheckLines(findings, config.gpio);
    CheckSerialLines(findings, config);
  }
  CheckRelease(findings);
  if (config.motion_driver != MotionDriver::tic) CheckRealTime(findings, config.gpio.real_time);
  CheckTics(findings, config);
  CheckKernelCameras(findings, config);
  CheckLibcamera(findings, config);
  CheckStillCameras(findings, config);
  CheckLight(findings, config.light);

  CommandOutput output{{{"findings", Json::array()}}, ""};
  bool bad = false;
  for (const Finding& finding : findings) {
    const char* verdict = kVerdictNames[static_cast<int>(finding.verdict)];
    bad = bad || finding.verdict == Verdict::bad;
    output.json["findings"].push_back({{"verdict", verdict},
                                       {"subject", finding.subject},
                                       {"what", finding.what},
                                       {"mend", finding.mend}});
    output.text += fmt::format("{:<5} {:<17} {}\n", verdict, finding.subject, finding.what);
    if (!finding.mend.empty()) output.text += fmt::format("{:>24}mend: {}\n", "", finding.mend);
  }
  output.json["ready"] = !bad;
  output.exit_code = bad ? 1 : 0;
  return output;
}

}  // namespace

void AddDoctor(CommandSet& commands) {
  auto config = std::make_shared<std::filesystem::path>();
  commands
      .Add(
          "doctor",
          "What this machine has and lacks for a station, and how to mend it; exit code 1 when the "
          "station is not ready",
          [config](const CliContext&) { return RunDoctor(*config); })
      .add_option("--config", *config, "station file whose devices are looked for");
}

}  // namespace scan
