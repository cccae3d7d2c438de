#include "drivers/station/sim_world.h"

#include <cassert>
#include <cmath>

#include "drivers/base/rng.h"
#include "drivers/base/units.h"
#include "drivers/station/geometry.h"
#include "drivers/station/sim_axis.h"

namespace scan {
namespace {

// One stream of random numbers per purpose: an error added later changes none of the others.
enum class Stream : std::uint64_t { lens = 1, platter, axes, aims, views };

Rng RngOf(std::uint64_t seed, Stream stream, std::uint64_t item = 0) {
  Rng mix(seed ^ (static_cast<std::uint64_t>(stream) << 56) ^ (item * 0x9e3779b97f4a7c15ULL));
  return Rng(mix.Next());
}

double Sign(Rng& rng) { return rng.Uniform() < 0.5 ? -1.0 : 1.0; }

double BoundedNormal(Rng& rng, double sigma) {
  double value = rng.Normal();
  while (std::abs(value) > 2) value = rng.Normal();
  return value * sigma;
}

Eigen::Vector3d BoundedNormal3(Rng& rng, double sigma) {
  const double x = BoundedNormal(rng, sigma), y = BoundedNormal(rng, sigma);
  return {x, y, BoundedNormal(rng, sigma)};
}

std::vector<LostSteps> LostOf(const StationConfig& config, std::string_view axis) {
  std::vector<LostSteps> lost;
  for (const LostSteps& entry : config.sim.lost_steps) {
    if (entry.axis == axis) lost.push_back(entry);
  }
  return lost;
}

// Somewhere away from the home switch, on a whole step.
std::int64_t StartSteps(const AxisConfig& axis, double units) {
  return std::llround(-axis.homing.direction * units * axis.sign * axis.steps_per_unit);
}

// x_true = Exp(w) x + rho in the camera frame, about the camera centre.
CameraFromLift Perturbed(const CameraFromLift& camera_from_lift, const Eigen::Vector3d& w,
                         const Eigen::Vector3d& rho) {
  const double angle = w.norm();
  Eigen::Isometry3d delta = Eigen::Isometry3d::Identity();
  if (angle > 0) delta.linear() = Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
  delta.translation() = rho;
  return CameraFromLift(delta * camera_from_lift.isometry());
}

constexpr double kVibrationHz = 35;

}  // namespace

SimWorld::SimWorld(const StationConfig& config)
    : config_(config),
      aim_(config.aims.empty() ? "" : config.aims.front().id),
      table_from_model_(MakeTableFromModel(config.sim.placement)) {
  DrawStaticErrors();
}

SimWorld::~SimWorld() = default;

void SimWorld::DrawStaticErrors() {
  const SimErrors& errors = config_.sim.errors;
  const std::uint64_t seed = config_.sim.seed;

  Rng axes = RngOf(seed, Stream::axes);
  const double turntable_start = axes.Uniform(20, 300);
  const double lift_start = axes.Uniform(5, 30);
  const double lift_scale = Sign(axes) * errors.lift_scale_rel;
  const double turntable_offset = BoundedNormal(axes, errors.homing_offset_deg);
  const double lift_offset = BoundedNormal(axes, errors.homing_offset_mm);
  turntable_ = std::make_shared<SimAxis>(
      config_.turntable, SimAxis::Errors{errors.backlash_deg, 0, turntable_offset},
      StartSteps(config_.turntable, turntable_start), LostOf(config_, "turntable"));
  lift_ = std::make_shared<SimAxis>(config_.lift,
                                    SimAxis::Errors{errors.backlash_mm, lift_scale, lift_offset},
                                    StartSteps(config_.lift, lift_start), LostOf(config_, "lift"));

  Rng platter = RngOf(seed, Stream::platter);
  const double tilt_towards = platter.Uniform(0, 2 * kPi);
  axis_tilt_ = Eigen::AngleAxisd(RadFromDeg(errors.axis_tilt_deg),
                                 Eigen::Vector3d(std::cos(tilt_towards), std::sin(tilt_towards), 0))
                   .toRotationMatrix();
  const double runout_towards = platter.Uniform(0, 2 * kPi);
  runout_direction_ = {std::cos(runout_towards), std::sin(runout_towards), 0};
  runout_phase_rad_ = platter.Uniform(0, 2 * kPi);

  Rng lens = RngOf(seed, Stream::lens);
  Rng aims = RngOf(seed, Stream::aims);
  for (const CameraConfig& camera : config_.cameras) {
    TrueCamera& truth = cameras_[camera.id];
    truth.intrinsics = NominalIntrinsics(camera);
    const double focal = 1 + Sign(lens) * errors.focal_rel;
    const double towards = lens.Uniform(0, 2 * kPi);
    truth.intrinsics.fl_x *= focal;
    truth.intrinsics.fl_y *= focal;
    truth.intrinsics.cx += errors.principal_point_px * std::cos(towards);
    truth.intrinsics.cy += errors.principal_point_px * std::sin(towards);
    for (const AimConfig& aim : config_.aims) {
      const Eigen::Vector3d w = BoundedNormal3(aims, RadFromDeg(errors.aim_rotation_deg));
      const Eigen::Vector3d rho = BoundedNormal3(aims, errors.aim_translation_mm);
      truth.camera_from_lift[aim.id] =
          Perturbed(NominalCameraFromLift(config_, camera, aim), w, rho);
    }
  }
}

std::shared_ptr<AxisPhysics> SimWorld::turntable() const { return turntable_; }
std::shared_ptr<AxisPhysics> SimWorld::lift() const { return lift_; }

void SimWorld::SetAim(std::string aim_id) {
  std::lock_guard lock(mutex_);
  aim_ = std::move(aim_id);
}
std::string SimWorld::aim() const {
  std::lock_guard lock(mutex_);
  return aim_;
}
void SimWorld::SetLight(bool on) {
  std::lock_guard lock(mutex_);
  light_on_ = on;
}
void SimWorld::SetSpecimenPresent(bool present) {
  std::lock_guard lock(mutex_);
  specimen_present_ = present;
}
void SimWorld::SetTableFromModel(const TableFromModel& table_from_model) {
  std::lock_guard lock(mutex_);
  table_from_model_ = table_from_model;
}
TableFromModel SimWorld::table_from_model() const {
  std::lock_guard lock(mutex_);
  return table_from_model_;
}

void SimWorld::LoseSteps(std::string_view axis, std::int64_t count) {
  assert(axis == "turntable" || axis == "lift");
  (axis == "lift" ? lift_ : turntable_)->Lose(count);
}

Intrinsics SimWorld::TrueIntrinsics(std::string_view camera_id) const {
  return cameras_.find(camera_id)->second.intrinsics;
}

CameraFromLift SimWorld::TrueCameraFromLift(std::string_view camera_id,
                                            std::string_view aim_id) const {
  return cameras_.find(camera_id)->second.camera_from_lift.find(aim_id)->second;
}

// The runout is a wobble along one direction fixed in the station: unlike an eccentric platter it
// cannot hide in the specimen's own placement.
StationFromTable SimWorld::TrueStationFromTable(double turntable_rad) const {
  const double wobble_mm =
      config_.sim.errors.runout_mm * std::sin(turntable_rad + runout_phase_rad_);
  return StationFromTable(axis_tilt_ * MakeStationFromTable(turntable_rad).rotation(),
                          wobble_mm * runout_direction_);
}

TrueState SimWorld::StateAt(std::string_view camera_id, std::int64_t mono_ns) const {
  const SimErrors& errors = config_.sim.errors;
  const SimAxis::Place turntable = turntable_->Now();
  const SimAxis::Place lift = lift_->Now();
  // Drawn anew whenever an edge was emitted, so per view, and without a state of its own.
  Rng view = RngOf(config_.sim.seed, Stream::views,
                   static_cast<std::uint64_t>(turntable.edges * 1'000'003 + lift.edges));
  const double turntable_jitter = errors.view_sigma_deg * view.Normal();
  const double lift_jitter = errors.view_sigma_mm * view.Normal();
  const double since_s =
      static_cast<double>(std::max<std::int64_t>(0, mono_ns - turntable.last_edge_ns)) * 1e-9;
  const double vibration =
      turntable.edges == 0 ? 0
                           : errors.vibration_deg * std::exp(-since_s / errors.vibration_decay_s) *
                                 std::cos(2 * kPi * kVibrationHz * since_s);

  TrueState state;
  state.turntable_rad = RadFromDeg(turntable.position + turntable_jitter + vibration);
  state.lift_mm = lift.position + lift_jitter;
  state.intrinsics = TrueIntrinsics(camera_id);
  std::lock_guard lock(mutex_);
  state.camera_from_model = TrueCameraFromLift(camera_id, aim_) *
                            MakeLiftFromStation(state.lift_mm, LiftDirection(config_)) *
                            TrueStationFromTable(state.turntable_rad) * table_from_model_;
  state.specimen_present = specimen_present_;
  state.light_on = light_on_;
  return state;
}

}  // namespace scan
