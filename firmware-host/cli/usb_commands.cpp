// The USB bus and Tic boards tried by hand: scanstation device usb ACTION, device tic ACTION.
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <mutex>

#include "drivers/base/clock.h"
#include "drivers/motion/tic/tic_board.h"
#include "drivers/motion/tic/tic_protocol.h"
#include "drivers/usb/libusb_bus.h"
#include "drivers/usb/usb_access.h"
#include "firmware-host/cli/commands.h"

namespace scan {
namespace {

constexpr std::int64_t kWaitNs = 200'000'000;

Json ToJson(const UsbIdentity& identity) {
  return {{"port", identity.port},
          {"id", fmt::format("{:04x}:{:04x}", identity.vendor, identity.product)},
          {"serial", identity.serial},
          {"name", identity.name},
          {"node", UsbNode(identity)},
          {"permitted", CheckUsbAccess(identity).has_value()}};
}

Result<CommandOutput> ListUsb() {
  SCAN_TRY(const auto bus, MakeLibusbBus());
  SCAN_TRY(const auto devices, bus->List());
  CommandOutput output{{{"devices", Json::array()}}, ""};
  for (const UsbIdentity& device : devices) {
    output.json["devices"].push_back(ToJson(device));
    output.text += Describe(device) + (CheckUsbAccess(device) ? "\n" : "  (not permitted)\n");
  }
  if (output.text.empty()) output.text = "no USB device\n";
  return output;
}

// A line for every device that is there, comes or goes, until the token is requested.
Result<CommandOutput> WatchUsb(const CliContext& context) {
  SCAN_TRY(const auto bus, MakeLibusbBus());
  std::mutex mutex;  // two threads print: the one that starts the watch and the watch's own
  SCAN_TRY(const auto watch, bus->Watch([&](const UsbEvent& event) {
    std::lock_guard lock(mutex);
    Json json = ToJson(event.identity);
    json["arrived"] = event.arrived;
    fmt::print("{}\n", context.json ? json.dump()
                                    : (event.arrived ? "+ " : "- ") + Describe(event.identity));
    std::fflush(stdout);
  }));
  SystemClock clock;
  while (clock.SleepFor(kWaitNs, context.stop)) {
  }
  return CommandOutput{Json::object(), ""};
}

Result<CommandOutput> ResetUsb(const std::string& port) {
  SCAN_TRY(const auto bus, MakeLibusbBus());
  SCAN_TRY(const auto devices, bus->List());
  SCAN_TRY(const UsbIdentity found, FindUsb(devices, {0, {}, port, ""}, "device"));
  SCAN_TRY(const auto device, bus->Open(found));
  SCAN_CHECK(device->Reset());
  return CommandOutput{ToJson(found), fmt::format("reset {}\n", Describe(found))};
}

std::string Firmware(const UsbIdentity& board) {
  return fmt::format("{:x}.{:02x}", board.release >> 8, board.release & 0xff);
}

Result<CommandOutput> ListTics() {
  SCAN_TRY(const auto bus, MakeLibusbBus());
  SCAN_TRY(const auto devices, bus->List());
  CommandOutput output{{{"boards", Json::array()}}, ""};
  for (const UsbIdentity& board : devices) {
    const TicModel* model = FindTicModel(board.vendor, board.product);
    if (!model) continue;
    Json json = ToJson(board);
    json["model"] = model->name;
    json["firmware"] = Firmware(board);
    output.json["boards"].push_back(std::move(json));
    output.text += fmt::format("{}\n  serial    {}\n  port      {}\n  firmware  {}\n", model->name,
                               board.serial, board.port, Firmware(board));
    if (const Status access = CheckUsbAccess(board); !access) {
      output.text += fmt::format("  not permitted: {}\n", access.error().mend);
    }
  }
  if (output.text.empty()) output.text = "no Tic board is connected\n";
  return output;
}

Result<CommandOutput> TicStatus(const TicAxisWiring& wiring) {
  SCAN_TRY(std::shared_ptr<UsbBus> bus, MakeLibusbBus());
  TicBoard board(bus, wiring);
  SCAN_TRY(const TicVariables v, board.ReadVariables());
  SCAN_TRY(const TicSettings s, board.ReadSettings());
  const std::string errors = TicErrorWords(v.errors);
  CommandOutput output;
  output.json = ToJson(board.identity());
  output.json.update({{"state", NameOf(v.state)},
                      {"energized", v.energized},
                      {"position_uncertain", v.position_uncertain},
                      {"forward_limit", v.forward_limit},
                      {"reverse_limit", v.reverse_limit},
                      {"homing", v.homing},
                      {"errors", errors},
                      {"position_microsteps", v.position},
                      {"velocity_microsteps_s", v.velocity / kTicSpeedPerHz},
                      {"vin_v", v.vin_mv * 1e-3},
                      {"up_time_s", v.up_time_ms * 1e-3},
                      {"microsteps", TicMicrosteps(v.step_mode)},
                      {"control_mode", s.control_mode},
                      {"command_timeout_ms", s.command_timeout_ms}});
  output.text = fmt::format(
      "{}\nstate      {}, {}\nerrors     {}\nposition   {} microsteps{}, {:.1f} microsteps/s\n"
      "switches   forward {}, reverse {}\nsupply     {:.2f} V\nsteps      1/{}\n",
      Describe(board.identity()), NameOf(v.state), v.energized ? "energized" : "no current",
      errors.empty() ? "none" : errors, v.position, v.position_uncertain ? " (uncertain)" : "",
      v.velocity / kTicSpeedPerHz, v.forward_limit ? "active" : "inactive",
      v.reverse_limit ? "active" : "inactive", v.vin_mv * 1e-3, TicMicrosteps(v.step_mode));
  return output;
}

void AddUsb(CommandSet& commands, CLI::App& device) {
  CLI::App& group = commands.AddGroup(&device, "usb", "The USB bus (libusb)");
  commands.AddTo(group, "list", "Every device with its port, ids and serial number",
                 [](const CliContext&) { return ListUsb(); });
  commands.AddTo(group, "watch", "A line for every device that comes or goes, until interrupted",
                 [](const CliContext& context) { return WatchUsb(context); });
  auto port = std::make_shared<std::string>();
  commands
      .AddTo(group, "reset", "Reset a device as if it had been plugged in anew",
             [port](const CliContext&) { return ResetUsb(*port); })
      .add_option("--port", *port, "where it is plugged in, as listed")
      ->required();
}

void AddTic(CommandSet& commands, CLI::App& device) {
  CLI::App& group = commands.AddGroup(&device, "tic", "Pololu Tic boards (libusb)");
  commands.AddTo(group, "list", "Every board with its model, serial number, port and firmware",
                 [](const CliContext&) { return ListTics(); });
  auto wiring = std::make_shared<TicAxisWiring>();
  CLI::App& status =
      commands.AddTo(group, "status", "State, errors, position, switches and supply of a board",
                     [wiring](const CliContext&) { return TicStatus(*wiring); });
  status.add_option("--serial", wiring->serial, "its serial number, as listed");
  status.add_option("--port", wiring->port, "where it is plugged in, as listed");
}

}  // namespace

void AddUsbDevices(CommandSet& commands, CLI::App& device) {
  AddUsb(commands, device);
  AddTic(commands, device);
}

}  // namespace scan
