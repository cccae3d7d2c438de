// One station in plain structs, as its TOML file says it.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/base/result.h"
#include "drivers/camera/libcamera/libcamera_config.h"
#include "drivers/camera/ptp/ptp_config.h"
#include "drivers/camera/v4l2/v4l2_config.h"
#include "drivers/io/light_config.h"
#include "drivers/motion/axis_config.h"
#include "drivers/motion/gpio/gpio_motion_config.h"
#include "drivers/motion/tic/tic_config.h"
#include "drivers/motion/tmc2209/tmc2209_config.h"

namespace scan {

// Degrees and millimetres, as in the file; see configs/station-sim.toml for every key.
struct AimConfig {
  std::string id = "a0";
  double elevation_deg = 15;  // of the camera above the horizontal, seen from the point looked at
  double lift_mm = 0;         // lift position at which the nominal camera looks at that point
  double look_at_mm = 35;     // height of that point on the turntable axis, above the platter
  double distance_mm = 550;   // from that point to the camera's centre
  friend bool operator==(const AimConfig&, const AimConfig&) = default;
};

struct LensConfig {
  double focal_mm = 70;
  double sensor_width_mm = 23.6;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  friend bool operator==(const LensConfig&, const LensConfig&) = default;
};

// What gives the pictures.
enum class CameraDriver { sim, v4l2, libcamera, ptp };

struct CameraConfig {
  std::string id = "c0";
  std::string model = "simulated camera";
  CameraDriver driver = CameraDriver::sim;
  V4l2Config v4l2;            // of the v4l2 driver
  LibcameraConfig libcamera;  // of the libcamera driver
  PtpConfig ptp;              // of the ptp driver
  int w = 1848, h = 1224;
  double azimuth_deg = -90;  // where the camera stands, about the turntable axis from station +x
  LensConfig lens;
  double exposure_us = 8000;
  double gain = 1;
  double sigma_fl_rel = 0.0005;     // what is known of the focal length: calibrated
  double sigma_c_px = 0;            // and of the principal point; 0: 0.3 % of the width
  double sigma_rotation_deg = 0.2;  // of camera_from_lift, each of three components
  double sigma_translation_mm = 0.5;
  friend bool operator==(const CameraConfig&, const CameraConfig&) = default;
};

struct LiftGeometry {
  std::string kind = "pitch_axis";  // fixed_pitch manual_aim arc pitch_axis
  std::array<double, 3> direction_in_station{0, 0, 1};
  friend bool operator==(const LiftGeometry&, const LiftGeometry&) = default;
};

struct RingConfig {
  std::string aim = "a0";
  int count = 12;
  double start_deg = 0;
  friend bool operator==(const RingConfig&, const RingConfig&) = default;
};

struct PlanConfig {
  std::vector<RingConfig> rings;
  friend bool operator==(const PlanConfig&, const PlanConfig&) = default;
};

enum class ErrorLevel { ideal, static_errors, dynamic };

// How far the simulated station is from what its configuration says. Sizes of fixed errors are
// magnitudes, their directions and signs are drawn from the seed; sigmas are drawn.
struct SimErrors {
  // static
  double focal_rel = 0;
  double principal_point_px = 0;
  double runout_mm = 0;
  double axis_tilt_deg = 0;
  double backlash_deg = 0, backlash_mm = 0;
  double lift_scale_rel = 0;
  double aim_rotation_deg = 0;    // 1 sigma of each component, cut at 2 sigma
  double aim_translation_mm = 0;  // the same
  double homing_offset_deg = 0, homing_offset_mm = 0;
  // dynamic
  double view_sigma_deg = 0, view_sigma_mm = 0;  // 1 sigma, drawn anew after every move
  double vibration_deg = 0;                      // amplitude just after the last step
  double vibration_decay_s = 0.05;
  int late_frames = 0;  // grabs (from the third on) answered with a frame exposed before
  friend bool operator==(const SimErrors&, const SimErrors&) = default;
};

// The defaults of each level.
SimErrors DefaultSimErrors(ErrorLevel level);
// ideal static dynamic. Errors: bad_input for another word.
Result<ErrorLevel> ParseErrorLevel(std::string_view word);

// Lost on request: when the axis has made `after_steps` steps, the next `count` move nothing.
struct LostSteps {
  std::string axis = "turntable";  // turntable lift
  std::int64_t after_steps = 0;
  std::int64_t count = 0;
  friend bool operator==(const LostSteps&, const LostSteps&) = default;
};

struct PlacementConfig {
  double yaw_deg = 37;
  double tilt_deg = 4;
  double tilt_axis_deg = 20;  // of the horizontal axis of the tilt, from table +x
  std::array<double, 3> offset_mm{1.5, -0.8, 20};  // of the pivot; z: the stand's height
  std::array<double, 3> pivot_in_model_mm{0, 0, 0};
  friend bool operator==(const PlacementConfig&, const PlacementConfig&) = default;
};

struct SimConfig {
  std::uint64_t seed = 1;
  std::string specimen = "beetle";  // read by the composition root
  SimErrors errors;
  std::vector<LostSteps> lost_steps;
  PlacementConfig placement;
  double noise = 1.0;          // grey levels at mid grey, 1 sigma
  std::string format = "jpg";  // jpg png
  int jpeg_quality = 95;
  int settings_delay_frames = 0;  // frames until new settings apply
  double frame_interval_ms = 100;
  friend bool operator==(const SimConfig&, const SimConfig&) = default;
};

// What moves the axes.
enum class MotionDriver { sim, gpio, tic };

struct StationConfig {
  std::string name = "simulated station";
  MotionDriver motion_driver = MotionDriver::sim;
  GpioMotionConfig gpio;                          // of the gpio driver
  TicMotionConfig tic;                            // of the tic driver
  Tmc2209Config turntable_tmc2209, lift_tmc2209;  // beside the gpio driver
  LightConfig light;
  AxisConfig turntable, lift;
  LiftGeometry lift_geometry;
  std::vector<CameraConfig> cameras;
  std::vector<AimConfig> aims;
  PlanConfig plan;
  SimConfig sim;
};

// The station of configs/station-sim.toml, without a file.
StationConfig DefaultSimStation();

// What the file cannot say wrong twice: ranges, references between the parts, everything that
// another part relies on. Errors: bad_input with the key in `where`.
Status Validate(const StationConfig& config);

const CameraConfig* FindCamera(const StationConfig& config, std::string_view id);
const AimConfig* FindAim(const StationConfig& config, std::string_view id);

}  // namespace scan
