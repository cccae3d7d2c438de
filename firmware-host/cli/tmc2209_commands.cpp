// TMC2209 drivers by hand: scanstation device tmc2209 ACTION; scanstation-motiond must not be
// running.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "drivers/motion/tmc2209/tmc2209_bus.h"
#include "drivers/station/station_file.h"
#include "firmware-host/cli/commands.h"

namespace scan {
namespace {

struct TmcOptions {
  std::filesystem::path config;
  Tmc2209Config driver;
};

std::string FlagsText(const TmcFlags& flags) {
  std::string words = TmcFaultWords(flags);
  const auto add = [&](bool up, const char* name) {
    if (up) words += (words.empty() ? "" : ", ") + std::string(name);
  };
  add(flags.hot, "hot");
  add(flags.open_load, "open load (at rest without meaning)");
  return words.empty() ? "none" : words;
}

Result<CommandOutput> ShowStatus(const TmcOptions& options) {
  const Tmc2209Config& driver = options.driver;
  SCAN_TRY(const auto bus, Tmc2209Bus::Open(OpenSerialPort, driver.port));
  SCAN_TRY(const Tmc2209State state, ReadTmc2209(*bus, driver.address));
  return CommandOutput{
      {{"port", driver.port},
       {"address", driver.address},
       {"version", state.version},
       {"mscnt", state.mscnt},
       {"current_scale", state.current_scale},
       {"standstill", state.standstill},
       {"flags", FlagsText(state.flags)}},
      fmt::format("version        {:#04x}\nmicrostep      {} of 1024\ncurrent scale  {} of 31\n"
                  "standstill     {}\nflags          {}\n",
                  state.version, state.mscnt, state.current_scale, state.standstill ? "yes" : "no",
                  FlagsText(state.flags))};
}

// The drivers of a station file, as scanstation-motiond sets them up.
Result<CommandOutput> SetUp(const TmcOptions& options) {
  SCAN_TRY(const StationConfig station, LoadStationConfig(options.config));
  CommandOutput output{Json::array(), ""};
  for (const auto& [axis, driver] : {std::pair("turntable", &station.turntable_tmc2209),
                                     std::pair("lift", &station.lift_tmc2209)}) {
    if (driver->port.empty()) continue;
    SCAN_TRY(const auto bus, Tmc2209Bus::Open(OpenSerialPort, driver->port));
    SCAN_TRY(const TmcCurrents currents, SetUpTmc2209(*bus, *driver));
    output.json.push_back({{"axis", axis},
                           {"address", driver->address},
                           {"microsteps", driver->microsteps},
                           {"run_ma", currents.run_ma}});
    output.text += fmt::format("{}: address {}, {} microsteps, {:.0f} mA\n", axis, driver->address,
                               driver->microsteps, currents.run_ma);
  }
  if (output.text.empty()) {
    return BadInput("no axis has a TMC2209 there", options.config.string(),
                    "add an [axis.turntable.tmc2209] table");
  }
  return output;
}

}  // namespace

void AddTmcDevices(CommandSet& commands, CLI::App& device) {
  CLI::App& group = commands.AddGroup(
      &device, "tmc2209", "TMC2209 drivers on a serial line; scanstation-motiond must not run");
  auto asked = std::make_shared<TmcOptions>();
  CLI::App& status = commands.AddTo(group, "status", "Flags, microstep counter, current of one",
                                    [asked](const CliContext&) { return ShowStatus(*asked); });
  status.add_option("--port", asked->driver.port, "serial line (/dev/ttyAMA0)")->required();
  status.add_option("--address", asked->driver.address, "0 to 3, by its pins MS1 and MS2")
      ->check(CLI::Range(0, 3));
  auto options = std::make_shared<TmcOptions>();
  commands
      .AddTo(group, "setup", "Set up the drivers of a station file and read them back",
             [options](const CliContext&) { return SetUp(*options); })
      .add_option("--config", options->config, "station file")
      ->required();
}

}  // namespace scan
