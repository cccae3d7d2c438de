// session.json: what is captured and how, fixed before the first frame.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "drivers/base/result.h"
#include "drivers/motion/on_stop.h"

namespace scan {

inline constexpr std::string_view kSessionSchema = "scanstation.session/1";

struct SoftwareDocument {
  std::string name = "scanstation";
  std::string version;
};

// Zero or empty: not known.
struct CtDocument {
  Eigen::Vector3d voxel_mm = Eigen::Vector3d::Zero();
  std::string scanner;
  double kv = 0;
  double ua = 0;
  std::string filter;
  double source_object_mm = 0;
  double source_detector_mm = 0;
  std::string rights;
};


// In the axis' own unit, deg or mm.
struct AxisDocument {
  std::string unit;
  double steps_per_unit = 0;
  int sign = 1;
  std::optional<double> min, max;
  double backlash = 0;
  OnStop on_stop = OnStop::hold;
};

enum class LiftKind { fixed_pitch, manual_aim, arc, pitch_axis };

struct LiftDocument {
  LiftKind kind = LiftKind::fixed_pitch;
  Eigen::Vector3d direction_in_station = Eigen::Vector3d::UnitZ();  // unit length
};

// x_true = Exp(w) x_nominal + rho in the camera frame about the camera centre; one sigma for each
// of three components.
struct PriorSigma {
  double rotation_deg = 0;
  double translation_mm = 0;
  friend bool operator==(const PriorSigma&, const PriorSigma&) = default;
};

struct CameraDocument {
  std::string id;
  Intrinsics intrinsics;
  IntrinsicsSigma sigma;
  // By aim id: every aim of this camera; empty where the aim has no nominal pose.
  std::map<std::string, std::optional<CameraFromLift>> camera_from_lift;
  PriorSigma camera_from_lift_sigma;                                // of every aim
  std::map<std::string, PriorSigma> camera_from_lift_sigma_by_aim;  // of one aim, where it differs
  // By aim id: aims that name the same lens state share focal length, principal point and
  // distortion. An aim not named has a lens state of its own.
  std::map<std::string, std::string> lens_state;
};

struct PlannedView {
  std::string id;
  std::string camera;
  double turntable_deg = 0;
  double lift_mm = 0;
  double exposure_us = 0;  // 0: as the camera stands
  int slices = 1;
  std::string mounting_id = "m0";
  std::string aim_id = "a0";
  std::string name;  // base name of an imported photograph; empty: the id
};

struct StationDocument {
  std::optional<AxisDocument> turntable;
  std::optional<AxisDocument> lift_axis;
  LiftDocument lift;
  std::vector<CameraDocument> cameras;
};

struct SessionDocument {
  std::string id;
  std::int64_t created_utc_ns = 0;
  SoftwareDocument software;
  std::map<std::string, std::string> specimen;  // Darwin Core terms
  std::optional<CtDocument> ct;
  StationDocument station;
  std::vector<PlannedView> views;
  std::optional<double> approx_distance_mm;  // camera to specimen, of photographs without poses
};

// What the types cannot say: ids, duplicates, ranges, cameras and aims that views name.
// Errors: bad_input naming `file` and the field.
Status ValidateSessionDocument(const SessionDocument& document, const std::string& file);

// One planned view against the cameras and views that are known already (for plan_extend, too).
Status ValidatePlannedView(const PlannedView& view, const std::vector<CameraDocument>& cameras,
                           const std::string& where);

// Keys in a fixed order, doubles that read back the same. Errors: as Validate; failed for numbers
// that are not finite.
Result<std::string> SerialiseSessionDocument(const SessionDocument& document);

// Reads and validates; keys it does not know are ignored. Errors: bad_input naming `file` and the
// path of the field.
Result<SessionDocument> ParseSessionDocument(std::string_view text, const std::string& file);

}  // namespace scan
