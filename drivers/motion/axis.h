// One axis in its own unit: targets become edges, edges become a position.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/motion/axis_config.h"
#include "drivers/motion/axis_table.h"
#include "drivers/motion/motion.h"
#include "drivers/motion/step_plan.h"
#include "drivers/motion/step_port.h"

namespace scan {

// Plays its edges one at a time, when its owner says that the deadline has come, so that several
// axes interleave. Positions are in the unit of the configuration.
// Thread contract: one thread at a time (the owner locks).
class Axis {
 public:
  Axis(AxisConfig config, std::unique_ptr<StepPort> port);

  const AxisConfig& config() const { return config_; }
  AxisState state() const { return state_; }
  const std::string& fault() const { return fault_; }
  AxisReading Reading() const;
  std::int64_t counted_steps() const { return count_; }
  // Late steps that have shifted the time base, and by how much in all, since the axis was made.
  std::int64_t late_shifts() const { return late_shifts_; }
  std::int64_t shifted_ns() const { return shifted_ns_; }

  // Refuses a target that is not finite, outside the limits, or that this state does not accept.
  // Errors: bad_input; device when the axis is not homed or has a fault.
  Status CheckTarget(double target) const;

  // Motor current on, an old fault acknowledged, the position forgotten.
  Status BeginHoming();

  // Starts a move whose time base is `base_ns`; the last approach comes from one side when there
  // is backlash. Precondition: CheckTarget passed.
  Status BeginMove(double target, std::int64_t base_ns);
  // Starts a relative travel at a given velocity, for homing; limits are not looked at.
  Status BeginTravel(double distance, double velocity, std::int64_t base_ns);

  // The next edge of what runs; nothing when it has ended.
  std::optional<std::int64_t> NextDeadlineNs() const { return next_deadline_ns_; }
  // Emits that edge at `now_ns`. Law of late steps: below the self-starting rate a late step shifts
  // the rest of the schedule, above it (later than a quarter of the step period) it is a fault.
  Status EmitNext(std::int64_t now_ns);
  // Sense of the last edge in the axis' own unit; 0 before the first one.
  int last_sense() const { return last_sense_; }
  bool stopping() const { return stopping_; }

  // Ramps down from the last edge emitted.
  void BeginStop();
  // After the last edge: arrived, or stopped (then `on_stop` decides).
  Status EndMove();
  // Edges cease; the position is unknown.
  void Abort();
  void SetFault(std::string what);
  // Edges cease, the motor loses its current, a brake falls in; a fault until homed again.
  void CutPower(std::string why);

  // The switch that homing looks for.
  Result<bool> HomeSwitch();
  // The axis stands at its reference edge, reached in the sense of `approach`; ends homing.
  void SetReference();

 private:
  double CountedUnits() const;
  std::int64_t StepsAt(double units) const;
  StepLimits LimitsAt(double velocity) const;
  Status BeginEdges();
  void StartSegment(std::int64_t base_ns);
  void ClearMotion();
  void FindNextDeadline();
  void Advance(AxisEvent event);
  void FollowBacklash();
  Status AcceptLateStep(std::int64_t late_ns);

  AxisConfig config_;
  std::unique_ptr<StepPort> port_;
  AxisState state_ = AxisState::unpowered;
  std::string fault_;
  bool referenced_ = false;

  std::int64_t count_ = 0;  // edges emitted, signed, in the motor's sense
  double origin_ = 0;       // unit position of count 0
  double estimated_ = 0;    // behind the backlash
  double commanded_ = 0;

  std::deque<std::int64_t> waypoints_;  // counts still to reach, in turn
  double segment_velocity_ = 0;
  StepPlan plan_;
  std::int64_t base_ns_ = 0;
  std::int64_t next_edge_ = 0;
  std::optional<std::int64_t> next_deadline_ns_;
  std::int64_t last_edge_ns_ = 0;
  int last_sense_ = 0;
  bool stopping_ = false;
  std::vector<std::int64_t> stop_offsets_ns_;
  std::size_t next_stop_edge_ = 0;
  std::int64_t late_shifts_ = 0;
  std::int64_t shifted_ns_ = 0;
};

}  // namespace scan
