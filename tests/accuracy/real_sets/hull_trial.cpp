#include "tests/accuracy/real_sets/hull_trial.h"

#include <chrono>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "drivers/base/units.h"
#include "reconstruction/masks/contour.h"
#include "reconstruction/pose/contour_sample.h"
#include "reconstruction/pose/rigid_motion.h"
#include "reconstruction/pose/solve_joint.h"

namespace scan::test {
namespace {

using SteadyClock = std::chrono::steady_clock;

double SecondsFrom(SteadyClock::time_point start) {
  return std::chrono::duration<double>(SteadyClock::now() - start).count();
}

// Every second whole photograph, from the first or the second on.
std::vector<std::size_t> Half(const RealSet& set, std::size_t parity) {
  std::vector<std::size_t> half;
  std::size_t n = 0;
  for (std::size_t i = 0; i < set.whole.size(); ++i)
    if (set.whole[i] && n++ % 2 == parity) half.push_back(i);
  return half;
}

RealSet SubsetOf(const RealSet& set, std::span<const std::size_t> indices) {
  RealSet part = set;
  part.photos.photos.clear();
  part.masks.clear();
  part.truth.clear();
  part.whole.assign(indices.size(), true);
  for (const std::size_t i : indices) {
    part.photos.photos.push_back(set.photos.photos[i]);
    part.masks.push_back(set.masks[i]);
    part.truth.push_back(set.truth[i]);
  }
  return part;
}

// Pixels as OpenCV draws them, at `shift` binary places.
cv::Point AtOpenCv(const Eigen::Vector2d& pixel, int scale, int shift) {
  const Eigen::Vector2d p = (pixel * scale - Eigen::Vector2d(0.5, 0.5)) * (1 << shift);
  return {static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y()))};
}

void DrawHull(cv::Mat& picture, const ContourMesh& mesh, const PoseOf& pose, int scale,
              const cv::Scalar& bgr) {
  for (const ContourSample& s :
       FindContourSamples(mesh, pose.camera_from_model, pose.intrinsics, 4))
    cv::line(picture, AtOpenCv(s.pixel - s.half, scale, 4), AtOpenCv(s.pixel + s.half, scale, 4),
             bgr, 1, cv::LINE_AA, 4);
}

}  // namespace

Result<HullTrial> RunHullTrial(const RealSet& set, const HullTrialOptions& options) {
  HullTrial trial;
  const std::vector<std::size_t> others = Half(set, 1);
  std::vector<std::size_t> carving = Half(set, 0);
  if (options.hull_of_all) carving.insert(carving.end(), others.begin(), others.end());
  std::vector<HullView> views;
  for (const std::size_t i : carving)
    views.push_back({&set.masks[i], {set.truth[i], set.intrinsics}});
  trial.hull_views = views.size();
  auto start = SteadyClock::now();
  SCAN_TRY(trial.hull, VisualHull(views, set.box_mm, set.voxel_mm));
  trial.hull_seconds = SecondsFrom(start);
  std::vector<std::size_t> posed;
  for (const std::size_t k : EvenlySpread(others.size(), options.most_posed))
    posed.push_back(others[k]);
  trial.posed = SubsetOf(set, posed);
  JointOptions joint;
  joint.table_from_model = set.placing;
  if (!set.placing.empty()) {  // the model's frame is the table's: that is no guess
    joint.rig.mounting_rotation_rad = RadFromDeg(0.1);
    joint.rig.mounting_translation_mm = 0.5;
  }
  start = SteadyClock::now();
  SCAN_TRY(trial.poses, SolveJoint(trial.hull, trial.posed.photos, trial.posed.masks, joint));
  trial.solve_seconds = SecondsFrom(start);
  return trial;
}

Result<HullFigures> FiguresOf(const HullTrial& trial) {
  HullFigures figures;
  CalibratedCameras truth{trial.posed.intrinsics, {}};
  Poses all = trial.poses;
  for (std::size_t i = 0; i < all.views.size(); ++i) {
    ViewPose& view = all.views[i];
    const CameraFromModel& known = trial.posed.truth[i];
    const CameraFromModel& solved = view.camera_from_model;
    truth.views[view.name] = known;
    if (view.status == ViewStatus::accepted) {
      ++figures.accepted;
      figures.sigma_deg.push_back(
          DegFromRad(std::sqrt(view.covariance.topLeftCorner<3, 3>().trace())));
    }
    view.status = ViewStatus::accepted;  // a rejected pose counts as well
    const Eigen::AngleAxisd off(known.rotation().transpose() * solved.rotation());
    figures.rotation_deg.push_back(DegFromRad(off.angle()));
    figures.azimuth_deg.push_back(DegFromRad(std::abs(off.angle() * off.axis().z())));
    figures.centre_mm.push_back((CameraCentre(known) - CameraCentre(solved)).norm());
    const Photo& photo = trial.posed.photos.photos[i];
    if (const auto placing = trial.posed.placing.find(photo.mounting_id);
        photo.camera_from_table && placing != trial.posed.placing.end())
      figures.nominal_deg.push_back(DegFromRad(
          AngleBetween(known.rotation(), (*photo.camera_from_table * placing->second).rotation())));
  }
  SCAN_TRY(figures.calibrated,
           CompareWithCalibrated(all, truth, trial.hull, trial.posed.photos, trial.posed.masks));
  return figures;
}

Status WriteOverlay(const HullTrial& trial, std::size_t view, const std::filesystem::path& png) {
  constexpr int kScale = 2;
  const Photo& photo = trial.posed.photos.photos[view];
  const Intrinsics& in = trial.posed.intrinsics;
  cv::Mat picture = cv::imread(photo.path.string());
  if (picture.empty()) return Failed("the photograph cannot be read", photo.path.string(), "");
  cv::resize(picture, picture, {in.w * kScale, in.h * kScale}, 0, 0, cv::INTER_AREA);
  for (const Contour& contour : ExtractContours(trial.posed.masks[view])) {
    std::vector<cv::Point> line;
    for (const ContourPoint& p : contour.points) line.push_back(AtOpenCv(p.position, kScale, 4));
    cv::polylines(picture, line, true, {0, 255, 0}, 1, cv::LINE_AA, 4);
  }
  const ContourMesh mesh(trial.hull);
  const ViewPose& solved = trial.poses.views[view];
  DrawHull(picture, mesh, {trial.posed.truth[view], in}, kScale, {255, 128, 0});
  DrawHull(picture, mesh, {solved.camera_from_model, IntrinsicsOf(trial.poses, solved, in)}, kScale,
           {0, 0, 255});
  if (!cv::imwrite(png.string(), picture))
    return Failed("the picture cannot be written", png.string(), "check the folder");
  return {};
}

}  // namespace scan::test
