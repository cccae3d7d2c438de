// The motors of the lab: follows every level that the kernel sets on the simulated board's lines,
// counts the steps, and moves the switches that the axes run onto.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "drivers/base/result.h"

namespace scan {

// The simulated board as guest/gpio.sh leaves it. Lines are counted from its first one.
struct LabBoard {
  unsigned base = 0;            // number of the first line in the kernel's trace events
  std::filesystem::path sysfs;  // holds sim_gpioN/{value,pull}
};

// From GPIO_BASE and GPIO_SYSFS. Errors: bad_input where they are not set.
Result<LabBoard> LabBoardFromEnvironment();

// Levels as anything outside would see and drive them. Errors: failed, naming the file.
Result<bool> ReadLevel(const LabBoard& board, unsigned line);
// Only lines that are inputs, or not in use, follow; an output takes it up when it is released.
Status DriveLevel(const LabBoard& board, unsigned line, bool high);

// How a motor is wired: rising edges of `step` count, up while `direction` is high, while `enable`
// is low.
struct LabMotor {
  std::string name;
  unsigned step = 0, direction = 0, enable = 0;
  std::optional<unsigned> endstop;  // high at positions <= 0
  std::optional<unsigned> index;    // high from each whole turn on, for `index_width` steps
  std::int64_t steps_per_turn = 0, index_width = 0;
  std::int64_t start = 0;  // position at first
};

// The lines and motors that guest/gpio.sh names: turntable (index) and lift (endstop).
LabMotor LabTurntable(std::int64_t start);
LabMotor LabLift(std::int64_t start);

// A switch that bounces does so at every step while it is pressed.
enum class SwitchFault { works, stuck_high, disconnected, bounces };

struct LabMotorState {
  std::int64_t position = 0;    // steps
  std::int64_t edges = 0;       // steps made, up or down
  std::int64_t idle_edges = 0;  // edges without current: they moved nothing
  bool powered = false;
};

// Thread contract: any thread.
class MotorModel {
 public:
  // From here on every level set counts. Errors: failed, where tracefs is not there.
  static Result<std::unique_ptr<MotorModel>> Start(LabBoard board, std::vector<LabMotor> motors);
  ~MotorModel();

  // Everything that was set before this call has been counted when it returns.
  // Errors: failed, when the kernel dropped events: no count can be trusted then.
  Status Sync();
  LabMotorState State(std::string_view motor) const;
  // What is broken about a motor's switch from its next change on (stuck: at once).
  Status Break(std::string_view motor, SwitchFault fault);
  // As if someone turned the motor by hand.
  Status Turn(std::string_view motor, std::int64_t steps);

 private:
  struct Motor {
    LabMotor wiring;
    LabMotorState state;
    bool direction_high = false;
    bool enable_high = true;
    std::map<unsigned, bool> driven;  // switches, by line
    SwitchFault fault = SwitchFault::works;
  };
  MotorModel() = default;
  void Run(std::stop_token stop);
  void OnLine(std::string_view line);
  void OnLevel(unsigned line, bool high);
  void MoveSwitches(Motor& motor);
  void DriveSwitch(Motor& motor, unsigned line, bool high);
  Motor& Find(std::string_view name);
  Status Mark(const std::string& text);

  LabBoard board_;
  std::filesystem::path trace_;  // an instance of its own in tracefs
  std::ifstream pipe_;
  mutable std::mutex mutex_;
  std::condition_variable synced_;
  std::vector<Motor> motors_;
  std::int64_t marks_ = 0, marks_seen_ = 0;
  bool lost_events_ = false;
  std::jthread thread_;
};

}  // namespace scan
