// What `scanstation pose` finds and writes: schema scanstation.poses/1.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "drivers/base/result.h"
#include "reconstruction/pose/diagnostics.h"

namespace scan {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

enum class ViewStatus { accepted, rejected };

// A direction that the data cannot determine; held at the prior.
struct FreeDirection {
  enum class Kind { rotation, translation, scale };
  enum class Scope { mounting, view, shared };
  Kind kind = Kind::rotation;
  Scope scope = Scope::mounting;
  std::string of;                                   // mounting id or view name; empty if shared
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  // model frame, unit length
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  // model frame, mm, on the axis
  double data_sigma = 0;  // what the data alone say: rad, mm or relative; infinite is written null
  std::string held_by;    // "turntable log", "prior", "gauge"
};

struct AlternativePose {
  CameraFromModel camera_from_model;
  double log_likelihood_gap = 0;  // below 4.6: cannot be told apart
};

struct SurfaceSigma {
  double median = 0, p95 = 0;  // pixels, full size
};

struct ViewPose {
  std::string name;  // base name of the photograph
  std::string lens_state;
  std::string mounting;
  std::string aim;
  ViewStatus status = ViewStatus::rejected;
  std::string reason;                 // of the rejection; empty when accepted
  CameraFromModel camera_from_model;  // rigid, mm of the mesh
  double cost_px = 0;                 // Eq 3, Euclidean, picture reduced to a longest side of 462
  double cost_l1_px = 0;              // Eq 3 with the authors' city-block transform, same picture
  double contour_rms_px = 0;          // full size
  // Marginal posterior of (w rad, rho mm), x_true = Exp(w) x_est + rho, x_est = camera_from_model
  // x, pivot the camera centre. Always finite.
  Matrix6d covariance = Matrix6d::Zero();
  // The same with log focal length, principal point (px), mask bias (px) and distortion behind it,
  // in the order of kEvidenceSize; empty where the method does not know it. Not written to
  // poses.json.
  Eigen::MatrixXd covariance_with_lens;
  SurfaceSigma surface_sigma_px;
  std::vector<AlternativePose> alternatives;
};

// A scalar shared by all views, with what is known of it.
struct SharedEstimate {
  double value = 0, sigma = 0, prior_sigma = 0;
};

struct LensEstimate {
  Intrinsics intrinsics;
  std::map<std::string, SharedEstimate> parameters;  // fl_rel, cx, cy, k1 with sigma and prior
};

struct MountingEstimate {
  std::string id;
  TableFromModel table_from_model;
};

struct AxisInCamera {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitY();  // unit length
  Eigen::Vector3d point = Eigen::Vector3d::Zero();       // mm
};

struct Poses {
  std::string method = "joint";
  std::string model;  // the mesh file's name
  std::map<std::string, LensEstimate> lens_states;
  std::map<std::string, SharedEstimate> nuisances;  // mask_bias_px, ct_scale, turntable offsets ...
  std::vector<MountingEstimate> mountings;
  std::map<std::string, AxisInCamera> axis_in_camera;  // per aim
  std::vector<FreeDirection> free_directions;
  std::vector<ViewPose> views;
  std::vector<std::string> notes;  // sentences for the report: what the data cannot show and why
  PoseDiagnostics diagnostics;     // not written to poses.json
};

// The solved camera of a view's lens state; `nominal` where the method solves none.
const Intrinsics& IntrinsicsOf(const Poses& poses, const ViewPose& view, const Intrinsics& nominal);

// poses.json. Errors of reading: bad_input with file and field.
Status WritePoses(const std::filesystem::path& path, const Poses& poses);
Result<Poses> ReadPoses(const std::filesystem::path& path);

}  // namespace scan
