#include <fmt/format.h>

#include <Eigen/Dense>
#include <numeric>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "drivers/base/units.h"
#include "tests/accuracy/real_sets/real_set.h"

namespace scan::test {
namespace {

constexpr int kWidth = 1000, kHeight = 750;

// Of the 15 landscape photographs of a chessboard that come with the set; 4000 x 3000.
Intrinsics PhoneCamera() {
  Intrinsics in{4000, 3000, 3031.6, 3032.7, 2006.8 + 0.5, 1512.2 + 0.5};
  in.k1 = 0.0752, in.k2 = -0.2178, in.p1 = 0.0009, in.p2 = 0.0003, in.k3 = 0.2501;
  return in;
}

// camera from board by the markers, which the photograph shows at half its size.
std::optional<Eigen::Isometry3d> BoardPose(const cv::Mat& half) {
  const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_7X7_1000);
  const auto board = cv::aruco::GridBoard::create(5, 7, 33, 6.75f, dictionary);  // mm
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(half, dictionary, corners, ids, parameters);
  const Intrinsics in = Scaled(PhoneCamera(), half.cols, half.rows);
  const cv::Matx33d k(in.fl_x, 0, in.cx - 0.5, 0, in.fl_y, in.cy - 0.5, 0, 0, 1);
  const cv::Vec<double, 5> d(in.k1, in.k2, in.p1, in.p2, in.k3);
  cv::Vec3d turn, shift;
  constexpr int kLeastMarkers = 12;
  if (cv::aruco::estimatePoseBoard(corners, ids, board, k, d, turn, shift) < kLeastMarkers)
    return std::nullopt;
  cv::Matx33d rotation;
  cv::Rodrigues(turn, rotation);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  Eigen::Matrix3d r;
  cv::cv2eigen(rotation, r);
  pose.linear() = r;
  pose.translation() = Eigen::Vector3d(shift[0], shift[1], shift[2]);
  return pose;
}

// Centre of the circle in x and y through points, least squares of its equation.
Eigen::Vector2d CircleCentre(const std::vector<Eigen::Vector3d>& points) {
  Eigen::MatrixX3d a(points.size(), 3);
  Eigen::VectorXd b(points.size());
  for (Eigen::Index i = 0; i < b.size(); ++i) {
    const Eigen::Vector3d& p = points[static_cast<std::size_t>(i)];
    a.row(i) << 2 * p.x(), 2 * p.y(), 1;
    b[i] = p.head<2>().squaredNorm();
  }
  return Eigen::Vector3d(a.colPivHouseholderQr().solve(b)).head<2>();
}

// The board's frame with z up and its origin at the middle of the cameras' circle.
void MoveToTable(std::vector<CameraFromModel>& cameras) {
  Eigen::Isometry3d board_from_table = Eigen::Isometry3d::Identity();
  board_from_table.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
  std::vector<Eigen::Vector3d> centres;
  for (CameraFromModel& camera : cameras) {
    camera = CameraFromModel(camera.isometry() * board_from_table);
    centres.push_back(CameraCentre(camera));
  }
  const Eigen::Vector2d middle = CircleCentre(centres);
  const Eigen::Isometry3d shift(Eigen::Translation3d(middle.x(), middle.y(), 0));
  for (CameraFromModel& camera : cameras) camera = CameraFromModel(camera.isometry() * shift);
}

// How far the board was turned, whole degrees against the first photograph.
double LoggedDeg(const CameraFromModel& camera, const CameraFromModel& first) {
  const Eigen::Matrix3d turn = first.rotation().transpose() * camera.rotation();
  return std::round(DegFromRad(std::atan2(turn(1, 0) - turn(0, 1), turn(0, 0) + turn(1, 1))));
}

Transform<frame::Camera, frame::Station> Nominal(const CameraFromModel& camera,
                                                 const NominalError& error) {
  const Eigen::Vector3d axis = Eigen::Vector3d::Ones().normalized();
  Eigen::Isometry3d off(Eigen::AngleAxisd(std::sqrt(3.0) * RadFromDeg(error.deg), axis));
  off.translation().setConstant(error.mm);
  return Transform<frame::Camera, frame::Station>(off * camera.isometry());
}

}  // namespace

std::optional<RealSet> LoadApple(const std::filesystem::path& folder, const NominalError& error) {
  RealSet set;
  set.intrinsics = Scaled(PhoneCamera(), kWidth, kHeight);
  set.box_mm = {Eigen::Vector3d(-70, -70, -5), Eigen::Vector3d(70, 70, 95)};
  set.voxel_mm = 1.0;
  for (int number = 0; number <= 40; number += 2) {
    Photo photo;
    photo.name = photo.id = fmt::format("day_green_apple{:02}", number);
    photo.path = folder / (photo.name + ".jpg");
    const cv::Mat half = cv::imread(photo.path.string(), cv::IMREAD_REDUCED_GRAYSCALE_2);
    const cv::Mat full =
        cv::imread((folder / ("mask_" + photo.name + ".png")).string(), cv::IMREAD_GRAYSCALE);
    if (half.empty() || full.empty()) return std::nullopt;
    const auto pose = BoardPose(half);
    if (!pose) return std::nullopt;
    Mask mask;
    cv::resize(full, mask.coverage, {kWidth, kHeight}, 0, 0, cv::INTER_AREA);
    set.photos.photos.push_back(photo);
    set.masks.push_back(mask);
    set.truth.push_back(CameraFromModel(*pose));
  }
  set.whole.assign(set.truth.size(), true);
  MoveToTable(set.truth);
  const auto nominal = Nominal(set.truth.front(), error);
  for (std::size_t i = 0; i < set.truth.size(); ++i) {
    Photo& photo = set.photos.photos[i];
    const double deg = LoggedDeg(set.truth[i], set.truth.front());
    photo.turntable_rad = AxisPrior{RadFromDeg(deg), 0, RadFromDeg(0.3)};
    photo.camera_from_table = nominal * MakeStationFromTable(RadFromDeg(deg));
    photo.sigma_view = {RadFromDeg(0.3), 3};  // the board slipped by up to 3 mm
  }
  set.photos.lens_states = {{"lens", set.intrinsics, {0.002, 1.0}}};
  set.photos.aims = {{"a0",
                      "c0",
                      0,
                      std::nullopt,
                      {RadFromDeg(std::hypot(error.deg, 0.5)), std::hypot(error.mm, 3)},
                      {}}};
  set.placing["m0"] = TableFromModel();
  return set;
}

}  // namespace scan::test
