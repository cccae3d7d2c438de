// Axis states, alarms and interlocks as data: what may be asked of an axis when, and what follows.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "drivers/motion/motion.h"

namespace scan {

constexpr std::size_t kAxisStates = 6;  // of AxisState, in motion.h

enum class AxisCommand { home, move, stop, abort, release, acknowledge };
constexpr std::size_t kAxisCommands = 6;

enum class AxisEvent {
  powered,         // motor current came on
  released,        // motor current went off
  motion_started,  // first edge of a move or of homing
  homed,
  arrived,
  stopped,  // ramped down; position known
  aborted,  // edges ceased; position unknown
  faulted,
  acknowledged
};
constexpr std::size_t kAxisEvents = 9;

enum class Interlock {
  cover_open,
  heartbeat_lost,
  limit_switch,
  late_step,
  emergency_stop,
  motor_power_off,     // the motors' supply is not there
  motor_power_not_cut  // it is there, although the emergency stop should have cut it
};
constexpr std::size_t kInterlocks = 7;

// How a motion that runs is ended.
enum class MotionEnd { none, stop, abort, power_cut };

constexpr std::uint8_t Bit(AxisCommand c) {
  return static_cast<std::uint8_t>(1U << static_cast<unsigned>(c));
}

// Which commands a state accepts, whether the count of steps says where the axis is, and whether
// the motor carries current.
struct AxisStateRow {
  AxisState state;
  std::string_view name;
  std::uint8_t accepts;
  bool position_known;
  bool powered;
  std::string_view mend;  // what a refused command should say
};

constexpr std::uint8_t kAlways = Bit(AxisCommand::stop) | Bit(AxisCommand::abort);

constexpr std::array<AxisStateRow, kAxisStates> kAxisStateTable{{
    {AxisState::unpowered, "unpowered", kAlways | Bit(AxisCommand::home), false, false,
     "home the axis"},
    {AxisState::unreferenced, "unreferenced",
     kAlways | Bit(AxisCommand::home) | Bit(AxisCommand::release), false, true, "home the axis"},
    {AxisState::idle, "idle",
     kAlways | Bit(AxisCommand::home) | Bit(AxisCommand::move) | Bit(AxisCommand::release), true,
     true, ""},
    {AxisState::moving, "moving", kAlways, true, true, "stop it, or wait until it has arrived"},
    {AxisState::held, "held",
     kAlways | Bit(AxisCommand::home) | Bit(AxisCommand::move) | Bit(AxisCommand::release), true,
     true, ""},
    {AxisState::fault, "fault", kAlways | Bit(AxisCommand::acknowledge) | Bit(AxisCommand::home),
     false, true, "remove the cause, then home the axis"},
}};

constexpr const AxisStateRow& Row(AxisState state) {
  return kAxisStateTable[static_cast<std::size_t>(state)];
}
constexpr bool Accepts(AxisState state, AxisCommand command) {
  return (Row(state).accepts & Bit(command)) != 0;
}

// The state after an event; nothing where the event cannot happen in that state.
constexpr std::optional<AxisState> Next(AxisState state, AxisEvent event) {
  using S = AxisState;
  using Cell = std::optional<AxisState>;
  constexpr Cell no = std::nullopt;
  constexpr Cell upw = S::unpowered, unref = S::unreferenced, idle = S::idle, mov = S::moving,
                 held = S::held, fault = S::fault;
  constexpr std::array<std::array<Cell, kAxisEvents>, kAxisStates> table{{
      // powered released started homed arrived stopped aborted faulted acknowledged
      {unref, upw, no, no, no, no, upw, fault, no},           // unpowered
      {unref, upw, mov, idle, no, unref, unref, fault, no},   // unreferenced
      {idle, upw, mov, no, idle, held, unref, fault, no},     // idle
      {no, fault, mov, idle, idle, held, unref, fault, no},   // moving
      {held, upw, mov, no, held, held, unref, fault, no},     // held
      {fault, fault, no, no, no, fault, fault, fault, unref}  // fault
  }};
  return table[static_cast<std::size_t>(state)][static_cast<std::size_t>(event)];
}

// What an interlock that trips forbids, how it ends a motion that runs, and whether a person must
// acknowledge it before anything moves again.
struct InterlockRow {
  Interlock interlock;
  std::string_view name;
  std::uint8_t forbids;
  MotionEnd ends_motion;
  Alarm alarm;
  bool latched;
};

constexpr std::array<InterlockRow, kInterlocks> kInterlockTable{{
    {Interlock::cover_open, "cover open", Bit(AxisCommand::home) | Bit(AxisCommand::move),
     MotionEnd::stop, Alarm::minor, false},
    {Interlock::heartbeat_lost, "heartbeat lost", Bit(AxisCommand::home) | Bit(AxisCommand::move),
     MotionEnd::stop, Alarm::major, true},
    {Interlock::limit_switch, "limit switch", Bit(AxisCommand::move), MotionEnd::stop,
     Alarm::invalid, true},
    {Interlock::late_step, "late step", Bit(AxisCommand::move), MotionEnd::abort, Alarm::invalid,
     true},
    {Interlock::emergency_stop, "emergency stop",
     Bit(AxisCommand::home) | Bit(AxisCommand::move) | Bit(AxisCommand::release),
     MotionEnd::power_cut, Alarm::invalid, true},
    {Interlock::motor_power_off, "motor power off", Bit(AxisCommand::home) | Bit(AxisCommand::move),
     MotionEnd::power_cut, Alarm::invalid, true},
    {Interlock::motor_power_not_cut, "motor power not cut by the emergency stop",
     Bit(AxisCommand::home) | Bit(AxisCommand::move) | Bit(AxisCommand::release),
     MotionEnd::power_cut, Alarm::invalid, true},
}};

constexpr const InterlockRow& Row(Interlock interlock) {
  return kInterlockTable[static_cast<std::size_t>(interlock)];
}
constexpr bool Forbids(Interlock interlock, AxisCommand command) {
  return (Row(interlock).forbids & Bit(command)) != 0;
}

// One alarm: stays up while its cause lasts, and a latched one until it is acknowledged as well.
class AlarmLatch {
 public:
  void Raise(Alarm alarm, bool latched) {
    if (alarm > alarm_) alarm_ = alarm;
    cause_present_ = true;
    acknowledged_ = acknowledged_ && !latched;
    latched_ = latched_ || latched;
    if (latched) acknowledged_ = false;
  }
  void CauseGone() {
    cause_present_ = false;
    Settle();
  }
  void Acknowledge() {
    acknowledged_ = true;
    Settle();
  }
  Alarm alarm() const { return alarm_; }

 private:
  void Settle() {
    if (!cause_present_ && (!latched_ || acknowledged_)) *this = AlarmLatch();
  }
  Alarm alarm_ = Alarm::none;
  bool cause_present_ = false;
  bool latched_ = false;
  bool acknowledged_ = false;
};

}  // namespace scan
