#include "reconstruction/report/pose_pictures.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "drivers/base/units.h"
#include "reconstruction/pose/contour_evidence.h"
#include "reconstruction/pose/lens_distortion.h"
#include "reconstruction/pose/nominal_pose.h"
#include "reconstruction/render/rasterise.h"

namespace scan {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kShift = 4;  // fraction bits of OpenCV's drawing
const cv::Scalar kInk(60, 60, 60), kCloud(190, 180, 165), kNominal(150, 110, 40);
const cv::Scalar kAccepted(60, 140, 30), kRejected(40, 40, 210), kFree(200, 40, 200);

bool HasPose(const ViewPose& view) {
  return view.camera_from_model.translation().z() > 0 &&
         view.camera_from_model.isometry().matrix().allFinite();
}

// OpenCV draws pixel (0, 0) at its centre, which is (0.5, 0.5) here.
cv::Point Fixed(const Vector2d& px) {
  static constexpr double kFar = 1e5;  // keeps the fixed point from wrapping round
  const auto fixed = [](double v) {
    return static_cast<int>(std::lround((std::clamp(v, -kFar, kFar) - 0.5) * (1 << kShift)));
  };
  return {fixed(px.x()), fixed(px.y())};
}

void Line(cv::Mat& picture, const Vector2d& a, const Vector2d& b, const cv::Scalar& colour) {
  cv::line(picture, Fixed(a), Fixed(b), colour, 1, cv::LINE_AA, kShift);
}

void Dashed(cv::Mat& picture, const Vector2d& a, const Vector2d& b, const cv::Scalar& colour) {
  constexpr double kDash = 7, kGap = 5;
  const double length = (b - a).norm();
  for (double at = 0; at < length; at += kDash + kGap)
    Line(picture, a + (b - a) * (at / length),
         a + (b - a) * (std::min(at + kDash, length) / length), colour);
}

void Text(cv::Mat& picture, const Vector2d& at, const std::string& text, const cv::Scalar& colour) {
  cv::putText(picture, text, {static_cast<int>(at.x()), static_cast<int>(at.y())},
              cv::FONT_HERSHEY_SIMPLEX, 0.42, colour, 1, cv::LINE_AA);
}

// Where a camera is drawn; the difference from its nominal centre enlarged.
std::optional<Vector3d> DrawnCentre(const RingCamera& camera, double enlarged) {
  if (!camera.solved) return camera.nominal;
  if (!camera.nominal) return camera.solved;
  return Vector3d(*camera.nominal + enlarged * (*camera.solved - *camera.nominal));
}

// So much that the middle difference is a twentieth of the ring's radius; differences are never
// made smaller.
double Enlargement(std::span<const RingCamera> cameras, const Vector3d& centre) {
  std::vector<double> difference, radius;
  for (const RingCamera& c : cameras) {
    if (!c.nominal || !c.solved) continue;
    difference.push_back((*c.solved - *c.nominal).norm());
    radius.push_back((*c.solved - centre).norm());
  }
  if (difference.empty()) return 1;
  std::sort(difference.begin(), difference.end());
  std::sort(radius.begin(), radius.end());
  const double middle = difference[difference.size() / 2];
  if (!(middle > 0)) return 1;
  return std::max(1.0, RoundFactor(radius[radius.size() / 2] / (20 * middle)));
}

std::vector<Vector3d> Cloud(const TriangleMesh& mesh) {
  constexpr std::size_t kPoints = 3000;
  std::vector<Vector3d> cloud;
  const std::size_t step = std::max<std::size_t>(1, mesh.vertices.size() / kPoints);
  for (std::size_t i = 0; i < mesh.vertices.size(); i += step)
    if (mesh.vertices[i].allFinite()) cloud.push_back(mesh.vertices[i]);
  return cloud;
}

ParallelView ObliqueView(std::span<const Vector3d> shown, const Vector3d& up, int side_px) {
  constexpr double kElevation = 35 * kPi / 180;
  constexpr double kMarginPx = 34;
  ParallelView view;
  const Vector3d axis = up.normalized();
  // From the front of the model, turned a little so that no axis is seen end on.
  Vector3d away = Vector3d(-0.45, 0.9, 0.2) - axis * axis.dot(Vector3d(-0.45, 0.9, 0.2));
  if (away.norm() < 0.2) away = axis.unitOrthogonal();
  away.normalize();
  view.right = away.cross(axis).normalized();
  view.up = std::cos(kElevation) * axis + std::sin(kElevation) * away;
  Eigen::AlignedBox2d box;
  for (const Vector3d& p : shown) box.extend(Vector2d(view.right.dot(p), view.up.dot(p)));
  view.centre = view.right * box.center().x() + view.up * box.center().y();
  view.px_per_mm = (side_px - 2 * kMarginPx) / std::max(box.sizes().maxCoeff(), 1e-3);
  const double height = std::ceil(box.sizes().y() * view.px_per_mm + 2 * kMarginPx + 24);
  view.middle_px = {0.5 * side_px, 0.5 * (height - 24)};
  return view;
}

void DrawAxes(cv::Mat& picture, const ParallelView& view, const Vector3d& centre,
              double length_mm) {
  const std::array<const char*, 3> names{"x", "y", "z"};
  const std::array<cv::Scalar, 3> colours{cv::Scalar(40, 40, 200), cv::Scalar(40, 140, 40),
                                          cv::Scalar(200, 80, 40)};
  for (int k = 0; k < 3; ++k) {
    const Vector3d tip = centre + length_mm * Vector3d::Unit(k);
    const auto colour = colours[static_cast<std::size_t>(k)];
    Line(picture, view(centre), view(tip), colour);
    Text(picture, view(tip) + Vector2d(3, 4), names[static_cast<std::size_t>(k)], colour);
  }
  Text(picture, {8, picture.rows - 9.0}, fmt::format("x, y, z: {:g} mm of the model", length_mm),
       kInk);
}

void DrawFreeRotation(cv::Mat& picture, const ParallelView& view, const FreeDirection& direction,
                      double reach_mm) {
  const Vector3d axis = direction.axis.normalized();
  const Vector3d a = direction.point - reach_mm * axis, b = direction.point + reach_mm * axis;
  Dashed(picture, view(a), view(b), kFree);
  // Three quarters of a turn round the upper end, with an arrow head.
  const Vector3d u = axis.unitOrthogonal(), v = axis.cross(u);
  const Vector3d middle = direction.point + 0.8 * reach_mm * axis;
  const auto at = [&](double angle) {
    return view(middle + 0.25 * reach_mm * (std::cos(angle) * u + std::sin(angle) * v));
  };
  constexpr int kSteps = 40;
  for (int i = 0; i < kSteps; ++i)
    Line(picture, at(1.5 * kPi * i / kSteps), at(1.5 * kPi * (i + 1) / kSteps), kFree);
  const Vector2d tip = at(1.5 * kPi);
  const Vector2d back = (at(1.3 * kPi) - tip).normalized() * 9;
  for (const double side : {-0.4, 0.4})
    Line(picture, tip, tip + Eigen::Rotation2Dd(side) * back, kFree);
}

void DrawCamera(cv::Mat& picture, const ParallelView& view, const RingCamera& camera,
                double enlarged, double arrow_mm) {
  const Vector2d at = view(*DrawnCentre(camera, enlarged));
  if (camera.nominal) {
    Line(picture, view(*camera.nominal), at, kNominal);
    cv::circle(picture, Fixed(view(*camera.nominal)), 5 << kShift, kNominal, 1, cv::LINE_AA,
               kShift);
  }
  if (!camera.solved) return;
  const cv::Scalar colour = camera.accepted ? kAccepted : kRejected;
  const Vector2d tip = view(*DrawnCentre(camera, enlarged) + arrow_mm * camera.forward);
  Line(picture, at, tip, colour);
  cv::circle(picture, Fixed(at), 3 << kShift, colour, cv::FILLED, cv::LINE_AA, kShift);
  // Behind the camera and away from its nominal mark.
  Vector2d outward = at - tip;
  if (outward.norm() > 1) outward.normalize();
  if (camera.nominal) {
    const Vector2d apart = at - view(*camera.nominal);
    if (apart.norm() > 1) outward += 1.2 * apart.normalized();
  }
  const Vector2d beside =
      outward.norm() > 0.1 ? Vector2d(outward.normalized() * 14) : Vector2d(9, 9);
  Text(picture, at + beside + Vector2d(-6, 4), camera.label, kInk);
}

// What moves a point's picture, of kEvidenceSize: all but the mask bias.
constexpr std::array<int, 10> kMoving{0, 1, 2, 3, 4, 5, 6, 7, 8, 10};
using Moving = Eigen::Matrix<double, kMoving.size(), 1>;

// Picture of a point of the camera frame when pose and lens are off by `d`: w, rho, log focal
// length, principal point, distortion.
std::optional<Vector2d> ProjectMoved(const Vector3d& x, Intrinsics intrinsics, const Moving& d) {
  const double angle = d.head<3>().norm();
  Vector3d moved = x;
  if (angle > 0) moved = Eigen::AngleAxisd(angle, d.head<3>() / angle) * x;
  intrinsics.k1 += d[9] * K1OfCorner(intrinsics);
  intrinsics.fl_x *= std::exp(d[6]);
  intrinsics.fl_y *= std::exp(d[6]);
  intrinsics.cx += d[7];
  intrinsics.cy += d[8];
  return Project(intrinsics, moved + d.segment<3>(3));
}

std::optional<SurfaceEllipse> EllipseOf(const Vector3d& in_camera, const ViewPose& view,
                                        const Intrinsics& intrinsics) {
  constexpr int kSize = kMoving.size();
  Eigen::Matrix<double, kSize, kSize> covariance = Eigen::Matrix<double, kSize, kSize>::Zero();
  if (view.covariance_with_lens.rows() == kEvidenceSize)
    covariance = view.covariance_with_lens(kMoving, kMoving);
  else
    covariance.topLeftCorner<6, 6>() = view.covariance;
  Eigen::Matrix<double, 2, kSize> J;
  for (int k = 0; k < kSize; ++k) {
    // Radians and relative, mm and px.
    const double step = k < 3 || k == 6 || k == 9 ? 1e-6 : 1e-3;
    Moving d = Moving::Zero();
    d[k] = step;
    const auto ahead = ProjectMoved(in_camera, intrinsics, d);
    d[k] = -step;
    const auto behind = ProjectMoved(in_camera, intrinsics, d);
    if (!ahead || !behind) return std::nullopt;
    J.col(k) = (*ahead - *behind) / (2 * step);
  }
  const auto centre = Project(intrinsics, in_camera);
  if (!centre) return std::nullopt;
  const SurfaceEllipse ellipse{*centre, J * covariance * J.transpose()};
  if (!ellipse.centre_px.allFinite() || !ellipse.covariance_px2.allFinite()) return std::nullopt;
  return ellipse;
}

// Half axes (larger second) and directions of a 1-sigma ellipse.
struct HalfAxes {
  Vector2d length_px;
  Eigen::Matrix2d direction;
};
HalfAxes HalfAxesOf(const Eigen::Matrix2d& covariance_px2) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(
      0.5 * (covariance_px2 + covariance_px2.transpose()));
  return {eigen.eigenvalues().cwiseMax(0).cwiseSqrt(), eigen.eigenvectors()};
}

}  // namespace

double RoundFactor(double value) {
  if (!(value > 0) || !std::isfinite(value)) return 1;
  const double power = std::pow(10.0, std::floor(std::log10(value) + 1e-9));
  const double lead = value / power + 1e-9;
  return power * (lead >= 5 ? 5 : lead >= 2 ? 2 : 1);
}

std::vector<RingCamera> RingOf(const PhotoSet& photos, const Poses& poses) {
  assert(photos.photos.size() == poses.views.size());
  std::vector<RingCamera> cameras;
  for (std::size_t i = 0; i < poses.views.size(); ++i) {
    const ViewPose& view = poses.views[i];
    if (!HasPose(view)) continue;
    RingCamera camera;
    camera.label = fmt::format("{}", i + 1);
    camera.solved = CameraCentre(view.camera_from_model);
    camera.forward = view.camera_from_model.rotation().row(2);
    camera.accepted = view.status == ViewStatus::accepted;
    const auto camera_from_table = NominalCameraFromTable(photos, photos.photos[i]);
    for (const MountingEstimate& m : poses.mountings) {
      if (!camera_from_table || m.id != view.mounting) continue;
      const Vector3d nominal = CameraCentre(*camera_from_table * m.table_from_model);
      if (nominal.allFinite()) camera.nominal = nominal;
    }
    cameras.push_back(camera);
  }
  return cameras;
}

Eigen::Vector3d UpInModel(const PhotoSet& photos, const Poses& poses) {
  const bool logged = std::any_of(photos.photos.begin(), photos.photos.end(), [&](const Photo& p) {
    return NominalCameraFromTable(photos, p).has_value();
  });
  if (logged && !poses.mountings.empty())
    return poses.mountings.front().table_from_model.rotation().row(2).normalized();
  Vector3d up = Vector3d::Zero();
  for (const ViewPose& view : poses.views)
    if (HasPose(view)) up -= view.camera_from_model.rotation().row(1);
  return up.norm() > 1e-6 ? Vector3d(up.normalized()) : Vector3d::UnitZ();
}

RingPicture DrawRing(std::span<const RingCamera> cameras, const TriangleMesh& mesh,
                     std::span<const FreeDirection> free_directions, const Eigen::Vector3d& up,
                     int side_px) {
  RingPicture ring;
  const std::vector<Vector3d> cloud = Cloud(mesh);
  Eigen::AlignedBox3d bounds;
  for (const Vector3d& p : cloud) bounds.extend(p);
  const Vector3d centre = bounds.isEmpty() ? Vector3d(Vector3d::Zero()) : Vector3d(bounds.center());
  const double radius_mm = bounds.isEmpty() ? 1 : std::max(0.5 * bounds.diagonal().norm(), 1e-3);

  std::vector<RingCamera> drawn;
  for (const RingCamera& camera : cameras) {
    const bool finite = camera.forward.allFinite() &&
                        (!camera.nominal || camera.nominal->allFinite()) &&
                        (!camera.solved || camera.solved->allFinite());
    if (finite && (camera.nominal || camera.solved)) drawn.push_back(camera);
  }
  if (drawn.empty() || !up.allFinite() || up.norm() < 1e-9) return ring;
  ring.enlarged = Enlargement(drawn, centre);
  std::vector<Vector3d> shown = cloud;
  for (const RingCamera& camera : drawn) {
    shown.push_back(*DrawnCentre(camera, ring.enlarged));
    if (camera.nominal) shown.push_back(*camera.nominal);
  }
  ring.view = ObliqueView(shown, up, side_px);
  const int height = static_cast<int>(std::lround(2 * ring.view.middle_px.y())) + 24;
  ring.picture = cv::Mat(height, side_px, CV_8UC3, cv::Scalar::all(255));

  for (const Vector3d& p : cloud)
    cv::circle(ring.picture, Fixed(ring.view(p)), 1 << (kShift - 1), kCloud, cv::FILLED,
               cv::LINE_AA, kShift);
  double reach_mm = 0;
  for (const RingCamera& camera : drawn)
    reach_mm = std::max(reach_mm, (*DrawnCentre(camera, ring.enlarged) - centre).norm());
  DrawAxes(ring.picture, ring.view, centre, RoundFactor(std::max(1.5 * radius_mm, reach_mm / 6)));
  for (const FreeDirection& direction : free_directions)
    if (direction.kind == FreeDirection::Kind::rotation && direction.point.allFinite() &&
        direction.axis.allFinite() && direction.axis.norm() > 1e-9)
      DrawFreeRotation(ring.picture, ring.view, direction, std::max(2 * radius_mm, reach_mm / 4));
  for (const RingCamera& camera : drawn)
    DrawCamera(ring.picture, ring.view, camera, ring.enlarged, 0.15 * reach_mm);
  return ring;
}

std::vector<SurfaceEllipse> SurfaceEllipses(const TriangleMesh& mesh, const ViewPose& view,
                                            const Intrinsics& intrinsics, int across) {
  constexpr int kSidePx = 240;  // of the picture that tells which points are visible
  std::vector<SurfaceEllipse> ellipses;
  if (mesh.faces.empty() || !HasPose(view) || across < 1) return ellipses;
  const double scale = static_cast<double>(kSidePx) / std::max(intrinsics.w, intrinsics.h);
  const Intrinsics small = Scaled(intrinsics, std::max(1, static_cast<int>(scale * intrinsics.w)),
                                  std::max(1, static_cast<int>(scale * intrinsics.h)));
  const Raster raster = Rasterise(mesh, view.camera_from_model, small);
  const cv::Mat seen = raster.face >= 0;
  const cv::Rect box = cv::boundingRect(seen);
  const int step = std::max(1, std::max(box.width, box.height) / across);
  for (int y = box.y + step / 2; y < box.y + box.height; y += step)
    for (int x = box.x + step / 2; x < box.x + box.width; x += step) {
      if (raster.face.at<std::int32_t>(y, x) < 0) continue;
      const Vector3d in_camera = RayOfPixel(small, {x + 0.5, y + 0.5}) *
                                 static_cast<double>(raster.depth_mm.at<float>(y, x));
      if (const auto ellipse = EllipseOf(in_camera, view, intrinsics)) ellipses.push_back(*ellipse);
    }
  return ellipses;
}

double EllipseFactor(std::span<const SurfaceEllipse> ellipses, double half_axis_px) {
  std::vector<double> larger;
  for (const SurfaceEllipse& e : ellipses)
    larger.push_back(HalfAxesOf(e.covariance_px2).length_px[1]);
  if (larger.empty()) return 1;
  std::sort(larger.begin(), larger.end());
  const double middle = larger[larger.size() / 2];
  return middle > 0 ? RoundFactor(half_axis_px / middle) : 1;
}

cv::Mat DrawEllipses(const cv::Mat& picture, std::span<const SurfaceEllipse> ellipses,
                     double factor) {
  assert(picture.type() == CV_8UC3);
  cv::Mat drawn;
  picture.convertTo(drawn, CV_8U, 0.6);
  const double longest = drawn.cols + drawn.rows;
  for (const SurfaceEllipse& e : ellipses) {
    if (!e.centre_px.allFinite() || !e.covariance_px2.allFinite()) continue;
    const HalfAxes axes = HalfAxesOf(e.covariance_px2);
    const Vector2d half = (factor * axes.length_px).cwiseMin(longest);
    constexpr int kSteps = 48;
    Vector2d before = e.centre_px + half[1] * axes.direction.col(1);
    for (int i = 1; i <= kSteps; ++i) {
      const double angle = 2 * kPi * i / kSteps;
      const Vector2d next = e.centre_px + half[1] * std::cos(angle) * axes.direction.col(1) +
                            half[0] * std::sin(angle) * axes.direction.col(0);
      Line(drawn, before, next, cv::Scalar(80, 220, 255));
      before = next;
    }
    cv::circle(drawn, Fixed(e.centre_px), 1 << kShift, cv::Scalar(255, 255, 255), cv::FILLED,
               cv::LINE_AA, kShift);
  }
  return drawn;
}

}  // namespace scan
