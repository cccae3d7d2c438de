#include "reconstruction/evaluate/calibrated.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/SVD>
#include <cmath>
#include <nlohmann/json.hpp>

#include "acquisition/session/json_fields.h"
#include "drivers/base/files.h"
#include "drivers/base/units.h"
#include "reconstruction/pose/contour_evidence.h"
#include "reconstruction/pose/contour_sample.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

constexpr double kWindowPx = 25;
constexpr double kSpacingPx = 2;

constexpr int kLargestSide = 1 << 20;  // px

struct Pair {
  Eigen::Matrix3d solved, calibrated;
};

// The rotation of the model frame that brings the calibrated cameras nearest to the solved ones.
Eigen::Matrix3d Alignment(const std::vector<Pair>& pairs) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Pair& p : pairs) sum += p.calibrated.transpose() * p.solved;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  return svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
}

// What turns the specimen from one calibrated view to the next, in the camera frame.
Eigen::Vector3d AxisOf(const std::vector<Pair>& pairs) {
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i + 1 < pairs.size(); ++i) {
    const Eigen::Vector3d w = LogSo3(pairs[i + 1].calibrated * pairs[i].calibrated.transpose());
    axis += w.dot(axis) < 0 ? Eigen::Vector3d(-w) : w;
  }
  return axis.normalized();
}

std::vector<double> SignedDistances(const ContourMesh& mesh, const PhotoContour& photo,
                                    const PoseOf& pose) {
  const auto samples =
      FindContourSamples(mesh, pose.camera_from_model, pose.intrinsics, kSpacingPx);
  const MatchResult match = MatchContour(samples, photo, 0, kWindowPx);
  std::vector<double> distances;
  for (const ContourMatch& m : match.matches) distances.push_back(m.residual_px);
  distances.insert(distances.end(), static_cast<std::size_t>(match.unmatched_px / kSpacingPx),
                   kWindowPx);
  return distances;
}

OutlineDistances PooledDistances(const ContourMesh& mesh, std::span<const Mask> masks,
                                 const std::vector<std::optional<PoseOf>>& poses) {
  std::vector<std::vector<double>> each(masks.size());
  tbb::parallel_for(std::size_t{0}, masks.size(), [&](std::size_t i) {
    if (poses[i]) each[i] = SignedDistances(mesh, MakePhotoContour(masks[i]), *poses[i]);
  });
  std::vector<double> all;
  for (const auto& distances : each) all.insert(all.end(), distances.begin(), distances.end());
  OutlineDistances pooled;
  pooled.swell_px = SpreadOf(all).median;
  std::vector<double> even;
  for (double& distance : all) {
    // A piece without a partner is not brought nearer.
    const bool alone = distance == kWindowPx;
    even.push_back(alone ? kWindowPx : std::abs(distance - pooled.swell_px));
    distance = std::abs(distance);
  }
  pooled.px = SpreadOf(std::move(all));
  pooled.even_px = SpreadOf(std::move(even));
  return pooled;
}

std::vector<MovedParameter> MovedLens(const Poses& poses, const PhotoSet& photos,
                                      const Intrinsics& truth) {
  std::vector<MovedParameter> moved;
  for (const LensState& lens : photos.lens_states) {
    const auto solved = poses.lens_states.find(lens.id);
    if (solved == poses.lens_states.end()) continue;
    const Intrinsics& nominal = lens.intrinsics;
    for (const auto& [name, estimate] : solved->second.parameters) {
      MovedParameter p{lens.id, name, estimate.value, estimate.sigma, estimate.prior_sigma, 0};
      if (name == "cx") {
        p.moved -= nominal.cx;
        p.truth = truth.cx - nominal.cx;
      } else if (name == "cy") {
        p.moved -= nominal.cy;
        p.truth = truth.cy - nominal.cy;
      } else if (name == "k1") {
        p.moved -= nominal.k1;
        p.truth = truth.k1 - nominal.k1;
      } else {
        p.truth = std::log(truth.fl_x / nominal.fl_x);
      }
      moved.push_back(p);
    }
  }
  return moved;
}

}  // namespace

Result<CalibratedCameras> ReadCalibrated(const std::filesystem::path& path) {
  SCAN_TRY(const std::string text, ReadTextFile(path));
  SCAN_TRY(const nlohmann::json json, ParseJson(text, path.string()));
  SCAN_TRY(const JsonObject root, JsonObject::Root(json, path.string()));
  CalibratedCameras cameras;
  Intrinsics& in = cameras.intrinsics;
  SCAN_TRY(in.w, root.Int("w", 1, kLargestSide));
  SCAN_TRY(in.h, root.Int("h", 1, kLargestSide));
  SCAN_TRY(in.fl_x, root.Number("fx"));
  SCAN_TRY(in.fl_y, root.Number("fy"));
  SCAN_TRY(in.cx, root.Number("cx"));
  SCAN_TRY(in.cy, root.Number("cy"));
  if (!(in.fl_x > 0 && in.fl_y > 0))
    return root.Wrong("fx", "focal length not positive", "give fx and fy in px");
  SCAN_TRY(const JsonObject views, root.Object("views"));
  for (const std::string& name : views.Keys()) {
    SCAN_TRY(const Eigen::Isometry3d pose, views.Rigid(name));
    cameras.views[name] = CameraFromModel(pose);
  }
  return cameras;
}

Result<CalibratedFigures> CompareWithCalibrated(const Poses& poses, const CalibratedCameras& truth,
                                                const TriangleMesh& mesh, const PhotoSet& photos,
                                                std::span<const Mask> masks) {
  CalibratedFigures figures;
  figures.views = poses.views.size();
  std::vector<Pair> pairs;
  std::vector<std::optional<PoseOf>> solved(poses.views.size()), calibrated(poses.views.size());
  for (std::size_t i = 0; i < poses.views.size(); ++i) {
    const ViewPose& view = poses.views[i];
    if (view.status != ViewStatus::accepted) continue;
    ++figures.accepted;
    const auto known = truth.views.find(view.name);
    if (known == truth.views.end()) continue;
    pairs.push_back({view.camera_from_model.rotation(), known->second.rotation()});
    solved[i] = PoseOf{view.camera_from_model,
                       IntrinsicsOf(poses, view, photos.intrinsics(photos.photos[i]))};
    calibrated[i] = PoseOf{known->second, truth.intrinsics};
  }
  for (const LensState& lens : photos.lens_states)
    if (lens.intrinsics.w != truth.intrinsics.w || lens.intrinsics.h != truth.intrinsics.h)
      return BadInput(
          fmt::format("calibrated for pictures of {} x {}, the photographs are {} x {}",
                      truth.intrinsics.w, truth.intrinsics.h, lens.intrinsics.w, lens.intrinsics.h),
          "truth", "give the calibration of these very pictures");
  if (pairs.size() < 3)
    return BadInput("fewer than three accepted views have a calibrated camera", "truth",
                    "names in the truth are the photographs' base names");
  const Eigen::Matrix3d alignment = Alignment(pairs);
  std::vector<double> aligned, neighbour;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Pair &p = pairs[i], &next = pairs[(i + 1) % pairs.size()];
    aligned.push_back(DegFromRad(AngleBetween(p.calibrated * alignment, p.solved)));
    neighbour.push_back(DegFromRad(AngleBetween(next.calibrated * p.calibrated.transpose(),
                                                next.solved * p.solved.transpose())));
  }
  figures.aligned_deg = SpreadOf(aligned);
  figures.neighbour_deg = SpreadOf(neighbour);
  if (poses.axis_in_camera.size() == 1) {
    const Eigen::Vector3d& axis = poses.axis_in_camera.begin()->second.direction;
    figures.axis_deg = DegFromRad(std::asin(std::min(1.0, axis.cross(AxisOf(pairs)).norm())));
  }
  figures.lens = MovedLens(poses, photos, truth.intrinsics);
  const ContourMesh contour_mesh(mesh);
  figures.contour = PooledDistances(contour_mesh, masks, solved);
  figures.contour_calibrated = PooledDistances(contour_mesh, masks, calibrated);
  return figures;
}

}  // namespace scan
