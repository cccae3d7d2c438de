#include "tests/lab/motor_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <charconv>
#include <cstdlib>

namespace scan {
namespace {

constexpr std::string_view kMark = "motor-model mark ";

Status WriteText(const std::filesystem::path& path, const std::string& text) {
  std::ofstream out(path);
  out << text << std::flush;
  if (out) return {};
  return Failed(fmt::format("cannot write '{}'", text), path.string(),
                "run this in the lab's guest, as root");
}

// Steps and enables matter when they rise as when they fall, except that a falling step does
// nothing.
std::string TraceFilter(const LabBoard& board, const std::vector<LabMotor>& motors) {
  std::string filter = "get == 0";
  for (const LabMotor& motor : motors) {
    filter += fmt::format(" && !(gpio == {} && value == 0)", board.base + motor.step);
  }
  return filter;
}

std::optional<std::int64_t> TakeNumber(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc()) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

std::filesystem::path LineFolder(const LabBoard& board, unsigned line) {
  return board.sysfs / fmt::format("sim_gpio{}", line);
}

}  // namespace

Result<LabBoard> LabBoardFromEnvironment() {
  const char* base = std::getenv("GPIO_BASE");
  const char* sysfs = std::getenv("GPIO_SYSFS");
  if (!base || !sysfs) {
    return BadInput("GPIO_BASE and GPIO_SYSFS are not set", "environment",
                    "source guest/gpio.sh first");
  }
  return LabBoard{static_cast<unsigned>(std::strtoul(base, nullptr, 10)), sysfs};
}

Result<bool> ReadLevel(const LabBoard& board, unsigned line) {
  const auto path = LineFolder(board, line) / "value";
  std::ifstream in(path);
  int value = 0;
  if (in >> value) return value != 0;
  return Failed("cannot read the level", path.string(), "source guest/gpio.sh first");
}

Status DriveLevel(const LabBoard& board, unsigned line, bool high) {
  return WriteText(LineFolder(board, line) / "pull", high ? "pull-up" : "pull-down");
}

LabMotor LabTurntable(std::int64_t start) {
  LabMotor motor{"turntable", 0, 1, 2, std::nullopt, 3};
  motor.steps_per_turn = 36'000;
  motor.index_width = 200;
  motor.start = start;
  return motor;
}

LabMotor LabLift(std::int64_t start) {
  LabMotor motor{"lift", 4, 5, 6, 8, std::nullopt};
  motor.start = start;
  return motor;
}

Result<std::unique_ptr<MotorModel>> MotorModel::Start(LabBoard board,
                                                      std::vector<LabMotor> motors) {
  const std::filesystem::path trace = "/sys/kernel/tracing/instances/motor-model";
  std::error_code error;
  std::filesystem::create_directory(trace, error);
  if (error) {
    return Failed(error.message(), trace.string(), "run this in the lab's guest, as root");
  }
  SCAN_CHECK(WriteText(trace / "buffer_size_kb", "8192"));
  SCAN_CHECK(WriteText(trace / "trace", ""));  // empties it
  SCAN_CHECK(WriteText(trace / "events/gpio/gpio_value/filter", TraceFilter(board, motors)));
  SCAN_CHECK(WriteText(trace / "events/gpio/gpio_value/enable", "1"));

  std::unique_ptr<MotorModel> model(new MotorModel);
  model->board_ = std::move(board);
  model->trace_ = trace;
  model->pipe_.open(trace / "trace_pipe");
  for (LabMotor& wiring : motors) {
    Motor motor{wiring, {wiring.start, 0, 0, false}, false, true, {}, SwitchFault::works};
    SCAN_TRY(motor.enable_high, ReadLevel(model->board_, wiring.enable));
    motor.state.powered = !motor.enable_high;
    model->motors_.push_back(std::move(motor));
    model->MoveSwitches(model->motors_.back());
  }
  model->thread_ = std::jthread([raw = model.get()](std::stop_token stop) { raw->Run(stop); });
  return model;
}

MotorModel::~MotorModel() {
  thread_.request_stop();
  (void)Mark("end");  // wakes the reader
  thread_.join();
  (void)WriteText(trace_ / "events/gpio/gpio_value/enable", "0");
}

void MotorModel::Run(std::stop_token stop) {
  std::string line;
  while (!stop.stop_requested() && std::getline(pipe_, line)) OnLine(line);
}

// "  task-12  [000] .....  1.234567: gpio_value: 1008 set 1", or a mark of ours.
void MotorModel::OnLine(std::string_view line) {
  constexpr std::string_view kValue = "gpio_value: ";
  std::lock_guard lock(mutex_);
  if (const auto at = line.find(kValue); at != std::string_view::npos) {
    std::string_view rest = line.substr(at + kValue.size());
    const auto gpio = TakeNumber(rest);
    const auto set = rest.find("set ");
    if (!gpio || set == std::string_view::npos) return;
    rest.remove_prefix(set + 4);
    const auto value = TakeNumber(rest);
    if (value && *gpio >= board_.base) {
      OnLevel(static_cast<unsigned>(*gpio) - board_.base, *value != 0);
    }
  } else if (const auto mark = line.find(kMark); mark != std::string_view::npos) {
    std::string_view rest = line.substr(mark + kMark.size());
    if (const auto number = TakeNumber(rest)) marks_seen_ = std::max(marks_seen_, *number);
    synced_.notify_all();
  } else if (line.find("LOST") != std::string_view::npos) {
    lost_events_ = true;
  }
}

void MotorModel::OnLevel(unsigned line, bool high) {
  for (Motor& motor : motors_) {
    if (line == motor.wiring.direction) motor.direction_high = high;
    if (line == motor.wiring.enable) {
      motor.enable_high = high;
      motor.state.powered = !high;
    }
    if (line != motor.wiring.step || !high) continue;
    if (!motor.state.powered) {
      ++motor.state.idle_edges;
      continue;
    }
    ++motor.state.edges;
    motor.state.position += motor.direction_high ? 1 : -1;
    MoveSwitches(motor);
  }
}

void MotorModel::MoveSwitches(Motor& motor) {
  const LabMotor& wiring = motor.wiring;
  const std::int64_t position = motor.state.position;
  if (wiring.endstop) DriveSwitch(motor, *wiring.endstop, position <= 0);
  if (wiring.index) {
    const std::int64_t turn = wiring.steps_per_turn;
    const std::int64_t within = ((position % turn) + turn) % turn;
    DriveSwitch(motor, *wiring.index, within < wiring.index_width);
  }
}

void MotorModel::DriveSwitch(Motor& motor, unsigned line, bool high) {
  if (motor.fault == SwitchFault::stuck_high) high = true;
  if (motor.fault == SwitchFault::disconnected) high = false;
  const auto before = motor.driven.find(line);
  const bool changed = before == motor.driven.end() || before->second != high;
  const bool bounces = motor.fault == SwitchFault::bounces && (changed || high);
  if (!changed && !bounces) return;
  motor.driven[line] = high;
  if (bounces) {
    for (int k = 0; k < 20; ++k) {
      (void)DriveLevel(board_, line, high);
      (void)DriveLevel(board_, line, !high);
    }
  }
  (void)DriveLevel(board_, line, high);
}

MotorModel::Motor& MotorModel::Find(std::string_view name) {
  const auto motor = std::find_if(motors_.begin(), motors_.end(),
                                  [&](const Motor& m) { return m.wiring.name == name; });
  assert(motor != motors_.end());
  return *motor;
}

Status MotorModel::Mark(const std::string& text) {
  return WriteText(trace_ / "trace_marker", std::string(kMark) + text);
}

Status MotorModel::Sync() {
  std::unique_lock lock(mutex_);
  const std::int64_t mark = ++marks_;
  lock.unlock();
  SCAN_CHECK(Mark(std::to_string(mark)));
  lock.lock();
  synced_.wait(lock, [&] { return marks_seen_ >= mark; });
  if (!lost_events_) return {};
  return Failed("the kernel dropped trace events", trace_.string(),
                "enlarge buffer_size_kb or step more slowly");
}

LabMotorState MotorModel::State(std::string_view motor) const {
  std::lock_guard lock(mutex_);
  return const_cast<MotorModel*>(this)->Find(motor).state;
}

Status MotorModel::Break(std::string_view motor, SwitchFault fault) {
  std::lock_guard lock(mutex_);
  Motor& found = Find(motor);
  found.fault = fault;
  MoveSwitches(found);
  return {};
}

Status MotorModel::Turn(std::string_view motor, std::int64_t steps) {
  std::lock_guard lock(mutex_);
  Motor& found = Find(motor);
  found.state.position += steps;
  MoveSwitches(found);
  return {};
}

}  // namespace scan
