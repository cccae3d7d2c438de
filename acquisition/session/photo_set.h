// The photographs of a session as evidence: what the reconstruction reads.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "drivers/base/result.h"

namespace scan {

// Gaussian prior on a small rigid motion about the camera centre, x_true = Exp(w) x + rho in the
// camera frame: one sigma for each of three components.
struct RigidSigma {
  double rotation_rad = 0;
  double translation_mm = 0;
};

// Camera, zoom and focus setting that share focal length, principal point and distortion.
struct LensState {
  std::string id;
  Intrinsics intrinsics;
  IntrinsicsSigma sigma;  // c_px already resolved (never 0)
};

// One aiming of one camera: its camera_from_lift is unknown up to the prior.
struct Aim {
  std::string id;
  std::string camera;
  int lens_state = 0;                              // index into PhotoSet::lens_states
  std::optional<CameraFromLift> camera_from_lift;  // nominal
  RigidSigma sigma;                                // error common to all frames of the aim
  std::filesystem::path background_plate;          // absolute; empty when there is none
};

// A logged axis position; radians or mm.
struct AxisPrior {
  double nominal = 0;
  double sigma_shared = 0;  // common to the reference epoch
  double sigma_view = 0;    // of this view alone
};

struct Photo {
  std::string id;                     // [a-z0-9-]+
  std::string name;                   // base name without extension
  std::filesystem::path path;         // absolute
  std::filesystem::path mask_path;    // absolute; empty when no mask exists
  std::filesystem::path ignore_path;  // absolute; empty when there is none
  int aim = 0;                        // index into PhotoSet::aims
  std::string mounting_id = "m0";
  int reference_epoch = 1;
  std::optional<CameraFromTable> camera_from_table;  // nominal; empty: no logged pose
  std::optional<AxisPrior> turntable_rad;
  std::optional<AxisPrior> lift_mm;
  RigidSigma sigma_view;         // further independent error of this frame's camera
  std::int64_t capture_seq = 0;  // rises in the order of capture; alike where that is unknown
};

struct PhotoSet {
  std::filesystem::path session;  // absolute folder
  std::vector<LensState> lens_states;
  std::vector<Aim> aims;
  std::vector<Photo> photos;  // in the order of the plan
  Eigen::Vector3d lift_direction_in_station = Eigen::Vector3d::UnitZ();
  std::optional<double> approx_distance_mm;

  const Intrinsics& intrinsics(const Photo& photo) const {
    return lens_states[aims[photo.aim].lens_state].intrinsics;
  }
};

// The last accepted frame of every view of a session folder, masks and plates found beside it.
// Errors: bad_input for a folder that is no session, or whose pictures are missing or of another
// size than its cameras say (only headers are read).
// Thread contract: pure.
Result<PhotoSet> LoadPhotoSet(const std::filesystem::path& session);

}  // namespace scan
