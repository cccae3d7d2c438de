// The physics that all simulated devices of one station share.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "drivers/motion/sim/sim_step_port.h"
#include "drivers/station/station_config.h"
#include "drivers/station/true_state.h"

namespace scan {

class SimAxis;

// Where things truly are: integrates the step edges that were emitted, behind backlash, runout,
// tilt and scale; holds the true lens and the true pose of every aim. All errors follow from
// `config.sim`, so equal configurations and equal edges give equal states.
// Precondition: the configuration is valid.
// Thread contract: every call may come from any thread.
class SimWorld {
 public:
  explicit SimWorld(const StationConfig& config);
  ~SimWorld();

  std::shared_ptr<AxisPhysics> turntable() const;
  std::shared_ptr<AxisPhysics> lift() const;

  void SetAim(std::string aim_id);
  std::string aim() const;
  void SetLight(bool on);
  void SetSpecimenPresent(bool present);
  // Puts the specimen somewhere else, as after turning it over.
  void SetTableFromModel(const TableFromModel& table_from_model);
  // The next `count` edges of an axis (turntable, lift) move nothing.
  void LoseSteps(std::string_view axis, std::int64_t count);

  // The state that a camera sees at an instant not before the last edge; exposure and noise seed
  // are the camera's to fill in. Precondition: the configuration has that camera.
  TrueState StateAt(std::string_view camera_id, std::int64_t mono_ns) const;

  Intrinsics TrueIntrinsics(std::string_view camera_id) const;
  CameraFromLift TrueCameraFromLift(std::string_view camera_id, std::string_view aim_id) const;
  // Where the platter stands, with tilt and runout, when it is truly turned by this angle.
  StationFromTable TrueStationFromTable(double turntable_rad) const;
  TableFromModel table_from_model() const;

 private:
  struct TrueCamera {
    Intrinsics intrinsics;
    std::map<std::string, CameraFromLift, std::less<>> camera_from_lift;  // by aim
  };
  void DrawStaticErrors();

  const StationConfig config_;
  std::shared_ptr<SimAxis> turntable_, lift_;
  std::map<std::string, TrueCamera, std::less<>> cameras_;
  Eigen::Matrix3d axis_tilt_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d runout_direction_ = Eigen::Vector3d::UnitX();  // in the station, horizontal
  double runout_phase_rad_ = 0;

  mutable std::mutex mutex_;  // guards all below
  std::string aim_;
  bool light_on_ = true;
  bool specimen_present_ = true;
  TableFromModel table_from_model_;
};

}  // namespace scan
