// Motion and GPIO lines tried by hand: scanstation device motion ACTION, through
// scanstation-motiond, and scanstation device gpio ACTION, on the lines themselves.
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>

#include "drivers/base/clock.h"
#include "drivers/io/gpio/gpio_pin.h"
#include "drivers/io/gpio/gpiod_lines.h"
#include "firmware-host/cli/commands.h"
#include "firmware-host/protocol/motion_client.h"
#include "firmware-host/protocol/motion_messages.h"
#include "firmware-host/protocol/socket.h"

namespace scan {
namespace {

constexpr std::int64_t kPollNs = 100'000'000;

struct MotionOptions {
  std::filesystem::path socket = "/run/scanstation/motiond.sock";
  StageTarget target;
};

Result<std::unique_ptr<MotionClient>> Connect(const MotionOptions& options) {
  auto fd = ConnectUnix(options.socket);
  if (!fd) {
    Error error = fd.error();
    error.mend = "start scanstation-motiond --config FILE, or name its --socket";
    return tl::unexpected(error);
  }
  return std::make_unique<MotionClient>(std::move(*fd));
}

std::string StatusText(const MotionStatus& status) {
  const auto axis = [](const char* name, AxisState state, const AxisReading& at, const char* unit) {
    return fmt::format("{:<11}{:<13}{:10.3f} {} counted, {:.3f} estimated\n", name,
                       AxisStateName(state), at.counted, unit, at.estimated);
  };
  return axis("turntable", status.turntable, status.position.turntable_deg, "deg") +
         axis("lift", status.lift, status.position.lift_mm, "mm") +
         fmt::format("homed      {} times\nalarm      {}{}{}\nfault      {}\n",
                     status.reference_epoch, NameOf(status.alarm),
                     status.interlocks.empty() ? "" : ": ", status.interlocks,
                     status.fault.empty() ? "none" : status.fault);
}

CommandOutput StatusOutput(Motion& motion) {
  const MotionStatus status = motion.ReadStatus();
  return {ToJson(status), StatusText(status)};
}

// A line for every change until the token is requested.
Result<CommandOutput> WatchMotion(const MotionOptions& options, const CliContext& context) {
  SCAN_TRY(const auto motion, Connect(options));
  SystemClock clock;
  std::string before;
  do {
    const MotionStatus status = motion->ReadStatus();
    const std::string text =
        fmt::format("turntable {} {:.3f} deg, lift {} {:.3f} mm, alarm {}{}{}{}{}",
                    AxisStateName(status.turntable), status.position.turntable_deg.counted,
                    AxisStateName(status.lift), status.position.lift_mm.counted,
                    NameOf(status.alarm), status.interlocks.empty() ? "" : ": ", status.interlocks,
                    status.fault.empty() ? "" : ", fault: ", status.fault);
    if (text != before) {
      fmt::print("{}\n", context.json ? ToJson(status).dump() : text);
      std::fflush(stdout);
    }
    before = text;
  } while (clock.SleepFor(kPollNs, context.stop));
  return CommandOutput{Json::object(), ""};
}

using MotionAction = std::function<Status(Motion&, const MotionOptions&, std::stop_token)>;

void AddAction(CommandSet& commands, CLI::App& group, const char* name, const char* description,
               MotionAction act) {
  auto options = std::make_shared<MotionOptions>();
  CLI::App& command = commands.AddTo(
      group, name, description,
      [options, act = std::move(act)](const CliContext& context) -> Result<CommandOutput> {
        SCAN_TRY(const auto motion, Connect(*options));
        SCAN_CHECK(act(*motion, *options, context.stop));
        return StatusOutput(*motion);
      });
  command.add_option("--socket", options->socket, "scanstation-motiond's socket")
      ->capture_default_str();
  if (std::string_view(name) != "move") return;
  command.add_option("--turntable-deg", options->target.turntable_deg, "target")->required();
  command.add_option("--lift-mm", options->target.lift_mm, "target")->required();
  command.add_option("--aim", options->target.aim_id, "the camera's aim")->capture_default_str();
}

void AddMotion(CommandSet& commands, CLI::App& device) {
  CLI::App& group =
      commands.AddGroup(&device, "motion", "Turntable and lift, through scanstation-motiond");
  AddAction(commands, group, "status", "States, positions, alarms",
            [](Motion&, const MotionOptions&, std::stop_token) { return Status(); });
  AddAction(commands, group, "home", "Find the home switches",
            [](Motion& motion, const MotionOptions&, std::stop_token stop) -> Status {
              SCAN_CHECK(motion.Home(stop));
              return {};
            });
  AddAction(commands, group, "move", "Move both axes to a target",
            [](Motion& motion, const MotionOptions& options, std::stop_token stop) -> Status {
              SCAN_CHECK(motion.MoveTo(options.target, stop));
              return {};
            });
  AddAction(commands, group, "stop", "Ramp down; the position stays known",
            [](Motion& motion, const MotionOptions&, std::stop_token) { return motion.Stop(); });
  AddAction(commands, group, "abort", "No step more; the position is unknown until homed",
            [](Motion& motion, const MotionOptions&, std::stop_token) { return motion.Abort(); });
  AddAction(
      commands, group, "acknowledge", "Clear latched alarms whose cause is gone",
      [](Motion& motion, const MotionOptions&, std::stop_token) { return motion.Acknowledge(); });
  auto options = std::make_shared<MotionOptions>();
  commands
      .AddTo(group, "watch", "A line for every change, until interrupted",
             [options](const CliContext& context) { return WatchMotion(*options, context); })
      .add_option("--socket", options->socket, "scanstation-motiond's socket")
      ->capture_default_str();
}

struct LightOptions {
  std::filesystem::path socket = "/run/scanstation/motiond.sock";
  std::string level;
  double seconds = 0;
};

// Nothing: the level of the station file.
Result<std::optional<double>> ParseLevel(const std::string& text) {
  if (text == "on") return std::nullopt;
  if (text == "off") return 0.0;
  double level = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), level);
  if (error == std::errc() && end == text.data() + text.size() && level >= 0 && level <= 1)
    return level;
  return BadInput(fmt::format("'{}' is no level", text), "device light",
                  "give on, off or a number from 0 to 1");
}

// Lit as long as the command runs: a lamp that nobody answers for goes dark.
Result<CommandOutput> SetLight(const LightOptions& options, const CliContext& context) {
  SCAN_TRY(const std::optional<double> level, ParseLevel(options.level));
  SCAN_TRY(const auto motion, Connect({options.socket, {}}));
  SCAN_CHECK(level ? motion->SetLightLevel(*level)
                   : motion->MakeLight(std::make_shared<SystemClock>())->Set(true));
  const bool lit = !level || *level > 0;
  if (lit) {
    fmt::print(stderr, "lit until {}\n",
               options.seconds > 0 ? fmt::format("{} s are over", options.seconds) : "interrupted");
    SystemClock clock;
    const auto lit_ns = options.seconds > 0 ? std::llround(options.seconds * 1e9)
                                            : std::numeric_limits<std::int64_t>::max() / 4;
    clock.SleepFor(lit_ns, context.stop);
    SCAN_CHECK(motion->SetLightLevel(0));
  }
  return CommandOutput{{{"light", options.level}},
                       fmt::format("light {}\n", lit ? "was lit" : "off")};
}

void AddLight(CommandSet& commands, CLI::App& device) {
  auto options = std::make_shared<LightOptions>();
  CLI::App& light = commands.AddTo(
      device, "light", "The station's lamp, through scanstation-motiond; lit until interrupted",
      [options](const CliContext& context) { return SetLight(*options, context); });
  light.add_option("level", options->level, "on (as the station file says), off, or 0 to 1")
      ->required();
  light.add_option("--seconds", options->seconds, "end after so long")
      ->check(CLI::Range(0.001, 1e6));
  light.add_option("--socket", options->socket, "scanstation-motiond's socket")
      ->capture_default_str();
}

Result<CommandOutput> ListGpio() {
  CommandOutput output{{{"libgpiod", GpiodVersion()}, {"chips", Json::array()}}, ""};
  for (const GpioChipInfo& chip : ListGpiodChips()) {
    Json lines = Json::array();
    output.text += fmt::format("{} ({}), {} lines\n", chip.label, chip.path, chip.lines.size());
    for (std::size_t k = 0; k < chip.lines.size(); ++k) {
      const GpioLineInfo& line = chip.lines[k];
      lines.push_back(
          {{"number", k}, {"name", line.name}, {"used", line.used}, {"consumer", line.consumer}});
      if (line.name.empty() && !line.used) continue;
      output.text +=
          fmt::format("  {:>3} {:<20}{}\n", k, line.name,
                      line.used ? fmt::format(" held by '{}'", line.consumer) : std::string());
    }
    output.json["chips"].push_back({{"label", chip.label}, {"path", chip.path}, {"lines", lines}});
  }
  if (output.text.empty()) {
    output.text = "no GPIO chip that this user may open (/dev/gpiochip*)\n";
  }
  return output;
}

struct GpioOptions {
  std::string chip;
  std::vector<std::string> lines;
  int count = 0;
};

Result<CommandOutput> WatchGpio(const GpioOptions& options, const CliContext& context) {
  GpioRequest request{options.chip, "scanstation device", {}};
  for (const std::string& text : options.lines) {
    SCAN_TRY(const GpioPin pin, ParseGpioPin(text));
    request.lines.push_back({pin.name, false, pin.active_low, false, pin.bias, true});
  }
  SCAN_TRY(const auto lines, OpenGpiodLines(request));
  const auto print = [&](std::size_t line, bool active, std::int64_t mono_ns) {
    const std::string& name = request.lines[line].name;
    fmt::print("{}\n", context.json
                           ? Json{{"line", name}, {"active", active}, {"mono_ns", mono_ns}}.dump()
                           : fmt::format("{:.6f} s  {:<20} {}", 1e-9 * static_cast<double>(mono_ns),
                                         name, active ? "active" : "inactive"));
    std::fflush(stdout);
  };
  for (std::size_t k = 0; k < lines->size(); ++k) {
    SCAN_TRY(const bool active, lines->Get(k));
    print(k, active, SystemClock().Now().mono_ns);
  }
  for (int seen = 0; options.count == 0 || seen < options.count;) {
    if (context.stop.stop_requested()) break;
    SCAN_TRY(const auto edge, lines->WaitEdge(kPollNs));
    if (!edge) continue;
    print(edge->line, edge->active, edge->mono_ns);
    ++seen;
  }
  return CommandOutput{Json::object(), ""};
}

void AddGpio(CommandSet& commands, CLI::App& device) {
  CLI::App& group = commands.AddGroup(&device, "gpio", "GPIO lines of the kernel (libgpiod)");
  commands.AddTo(group, "list", "Every chip with its label, lines and who holds them",
                 [](const CliContext&) { return ListGpio(); });
  auto options = std::make_shared<GpioOptions>();
  CLI::App& watch =
      commands.AddTo(group, "watch", "Levels and every edge of inputs, until interrupted",
                     [options](const CliContext& context) { return WatchGpio(*options, context); });
  watch.add_option("lines", options->lines, "NAME, !NAME, ^NAME, ~NAME as in a station file")
      ->required();
  watch.add_option("--chip", options->chip, "label of the chip; default: the one with these names");
  watch.add_option("--count", options->count, "end after so many edges; 0: never");
}

}  // namespace

void AddMotionDevices(CommandSet& commands, CLI::App& device) {
  AddMotion(commands, device);
  AddLight(commands, device);
  AddGpio(commands, device);
}

}  // namespace scan
