// The station as a chain of transforms with Gaussian priors: where every camera must be, given a
// few shared unknowns.
//
//   camera_from_model(view) = Exp(view) . Exp(aim) . camera_from_station(nominal)
//                           . lift(dlift) . axis . Rz(turntable + epoch + dturntable)
//                           . Exp(mounting) . table_from_model(start)
//
// where Exp(x) stands for x -> Exp(w) x + rho. One turntable offset per reference epoch, one camera
// deviation per aim, one tilted and shifted axis, one placing per mounting; per view a deviation of
// the logged axes and of the camera.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "drivers/base/units.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {

using CameraFromStation = Transform<frame::Camera, frame::Station>;

// Prior standard deviations that no session logs.
struct RigPriors {
  double axis_tilt_rad =
      0.5 * kPi / 180;  // turntable axis against the lift, each of two components
  double axis_shift_mm = 0.5;
  double mask_bias_px = 0.35;  // of the photographs; outward positive
  double ct_scale_rel = 1e-4;
  double mounting_rotation_rad = 1.0;  // about the start; wide, keeps every direction finite
  double mounting_translation_mm = 100;
  // Each view's camera moves at least this much of its own: what the static rig model leaves out
  // (wobble of the bearing, stiffness of the column).
  RigidSigma view_floor{0.01 * kPi / 180, 0.02};
};

constexpr int kLensSize = 4;

// Deviations from the nominal rig; all zero is the nominal rig at the start placing.
struct RigParameters {
  std::vector<std::array<double, 6>> mountings;  // w rad, rho mm in the table frame
  std::vector<double> epochs;                    // turntable offset, rad
  std::vector<std::array<double, 6>> aims;       // w rad, rho mm in the camera frame
  std::array<double, 4> axis{};                  // tilt about x, y rad; shift along x, y mm
  // Log focal length, principal point px, radial distortion at the corner (relative).
  std::vector<std::array<double, kLensSize>> lenses;
  // Per view: turntable rad, lift mm; then the camera's own w rad, rho mm.
  std::vector<std::array<double, 8>> views;
  double mask_bias_px = 0;
  double log_ct_scale = 0;
};

// What a view takes from the shared unknowns.
struct RigView {
  int mounting = 0, epoch = 0, aim = 0, lens = 0;
  int taken = 0;        // rank in the order of capture, as far as it is known
  bool logged = false;  // a nominal pose exists; else the view is a mounting of its own
  bool placed = false;  // set_view_start was called
  bool turns = false;   // a logged turntable angle exists
  // Nominal, at the logged lift: camera_from_table(nominal) . Rz(-turntable).
  CameraFromStation camera_from_station;
  double turntable_rad = 0;
  Eigen::Vector3d lift_direction = Eigen::Vector3d::UnitZ();  // in the station frame
  double sigma_turntable_rad = 0, sigma_lift_mm = 0;
  RigidSigma sigma_camera;
};

class RigModel {
 public:
  // A view without a nominal pose joins through the model alone: it is a mounting of its own, named
  // after the photograph's id with a space before it, its table the camera's frame moved to where
  // the specimen stands.
  RigModel(const PhotoSet& photos, const RigPriors& priors);

  const RigPriors& priors() const { return priors_; }
  void set_ct_scale_sigma(double relative) { priors_.ct_scale_rel = relative; }
  std::span<const RigView> views() const { return views_; }
  const std::vector<std::string>& mounting_ids() const { return mounting_ids_; }
  // "1" for the session's reference epoch 1; "1-from-v009" for what was split off from it.
  const std::vector<std::string>& epoch_names() const { return epoch_names_; }
  // A mounting that is one view without a nominal pose.
  static bool IsViewMounting(const std::string& id) { return id.starts_with(' '); }
  // For such a view: its start, and the specimen's distance with it.
  void set_view_start(int view, const CameraFromModel& camera_from_model,
                      const Eigen::Vector3d& mass_centre);
  double epoch_sigma_rad(int epoch) const { return epoch_sigma_rad_[epoch]; }
  const std::vector<RigidSigma>& aim_sigma() const { return aim_sigma_; }
  const std::vector<IntrinsicsSigma>& lens_sigma() const { return lens_sigma_; }
  const Intrinsics& nominal_intrinsics(int lens) const { return intrinsics_[lens]; }

  void set_start(int mounting, const TableFromModel& table_from_model) {
    start_[mounting] = table_from_model;
  }
  const TableFromModel& start(int mounting) const { return start_[mounting]; }

  // Lens parameters (as in RigParameters) that the solve holds at the nominal value; all of them at
  // first.
  bool held(int lens, int parameter) const { return held_[lens][parameter]; }
  void set_held(int lens, int parameter, bool held) { held_[lens][parameter] = held; }

  // Of `first_view` and all taken after it, those of its epoch get a turntable offset of their own,
  // those of its mounting a placing of their own; `parameters` grows by it, equal to what it was
  // split from.
  void SplitEpoch(int first_view, const std::string& name, double sigma_rad,
                  RigParameters& parameters);
  void SplitMounting(int first_view, const std::string& id, RigParameters& parameters);
  // Takes back a split: the views of the epoch belong to `into` again, which it was split from.
  void JoinEpoch(int epoch, int into, RigParameters& parameters);
  // The turntable turns against the sign of its log.
  void ReverseTurntable();

  RigParameters Nominal() const;

  CameraFromTable NominalCameraFromTable(int view) const;
  CameraFromTable CameraFromTableOf(const RigParameters& parameters, int view) const;
  // Rigid in the mesh's own mm: a CT scale s is divided out of the translation.
  CameraFromModel CameraFromModelOf(const RigParameters& parameters, int view) const;
  TableFromModel TableFromModelOf(const RigParameters& parameters, int mounting) const;
  Intrinsics IntrinsicsOf(const RigParameters& parameters, int lens) const;

 private:
  RigPriors priors_;
  std::vector<RigView> views_;
  std::vector<std::string> mounting_ids_;
  std::vector<std::string> epoch_names_;
  std::vector<double> epoch_sigma_rad_;
  std::vector<RigidSigma> aim_sigma_;
  std::vector<IntrinsicsSigma> lens_sigma_;
  std::vector<Intrinsics> intrinsics_;
  std::vector<std::array<bool, kLensSize>> held_;
  std::vector<TableFromModel> start_;
};

}  // namespace scan
