// One axis moved by a Tic board, which makes its own ramps.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>

#include "drivers/motion/axis_config.h"
#include "drivers/motion/axis_table.h"
#include "drivers/motion/motion.h"
#include "drivers/motion/tic/tic_board.h"

namespace scan {

// Goes through its phases one Poll() at a time. Positions are in the unit of the configuration.
// Thread contract: one thread at a time (the owner locks).
class TicAxis {
 public:
  TicAxis(AxisConfig config, std::unique_ptr<TicBoard> board);

  const AxisConfig& config() const { return config_; }
  AxisState state() const { return state_; }
  const std::string& fault() const { return fault_; }
  AxisReading Reading() const;
  const TicVariables& last() const { return last_; }  // what the board said last
  bool busy() const { return phase_ != Phase::rest; }

  // Opens the board, checks and writes its settings, takes the motor's current away.
  // Errors: device, with the setting that Pololu's tool must change.
  Status SetUp();

  // As Axis::CheckTarget.
  Status CheckTarget(double target) const;
  // Precondition: CheckTarget passed, not busy. A move of no steps leaves it not busy.
  Status BeginMove(double target, std::int64_t now_ns);
  // Motor current on, an old fault acknowledged, the position forgotten; then the board's own
  // homing: fast to the switch, slowly away from it, zero where it lets go.
  Status BeginHoming(std::int64_t now_ns);
  // Ramps down; in homing, where the position is not known anyway, it halts.
  Status BeginStop(std::int64_t now_ns);

  // Asks the board and goes on. Errors: the axis has a fault then.
  Status Poll(std::int64_t now_ns);
  // Keeps a resting board from its command timeout. Errors: as Poll.
  Status KeepAlive();
  bool limit_hit() const { return limit_hit_; }  // the last fault was a limit switch

  // The board halts at once; the position is unknown.
  void Abort();
  void CutPower(std::string why);
  // Takes the current away where the axis stays without it, else leaves the board holding.
  void Leave();

 private:
  enum class Phase { rest, readying, travelling, homing, stopping };

  std::int64_t StepsAt(double units) const;
  double UnitsAt(std::int64_t steps) const;
  bool HomesForward() const { return config_.homing.direction * config_.sign > 0; }
  Status SendLimits();
  Status Ready(std::int64_t now_ns);
  Status StartLeg(std::int64_t now_ns);
  Status FollowTravel(std::int64_t now_ns);
  Status FollowHoming(std::int64_t now_ns);
  Status FollowStop(std::int64_t now_ns);
  Status EndMove(bool stopped);
  void SetReference();
  void FollowBacklash();
  void Advance(AxisEvent event);
  Status Fault(std::string what, std::string mend);
  Status Checked(Status status);

  AxisConfig config_;
  std::unique_ptr<TicBoard> board_;
  AxisState state_ = AxisState::unpowered;
  std::string fault_;
  bool referenced_ = false;
  bool limit_hit_ = false;
  TicVariables last_;

  double commanded_ = 0, estimated_ = 0;
  Phase phase_ = Phase::rest;
  bool to_home_ = false;              // what readying is for
  std::deque<std::int64_t> targets_;  // steps still to reach, in turn
  std::int64_t leg_from_ = 0;
  std::int64_t deadline_ns_ = 0;  // of the phase
  std::int64_t alive_ns_ = 0;     // when the command timeout was last reset
  int quiet_polls_ = 0;
};

}  // namespace scan
