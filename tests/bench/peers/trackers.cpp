#include "trackers.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/rapid.hpp>

#include "../clocks.h"

namespace scan::bench {
namespace {

constexpr int kLines = 300;
constexpr int kReaches_px[] = {60, 30, 15, 8};  // at 1848 px
constexpr int kIterations = 12;                 // of each

cv::Ptr<cv::rapid::Tracker> Make(Tracker tracker, const cv::Mat& points, const cv::Mat& faces) {
  switch (tracker) {
    case Tracker::rapid:
      return cv::rapid::Rapid::create(points, faces);
    case Tracker::optimal_local:
      return cv::rapid::OLSTracker::create(points, faces);
    case Tracker::global_optimal:
      return cv::rapid::GOSTracker::create(points, faces);
  }
  return {};
}

const char* NameOf(Tracker tracker) {
  switch (tracker) {
    case Tracker::rapid:
      return "cv::rapid Rapid";
    case Tracker::optimal_local:
      return "cv::rapid OLS";
    case Tracker::global_optimal:
      return "cv::rapid GOS";
  }
  return "";
}

std::optional<CameraFromModel> Track(cv::rapid::Tracker& tracker, const cv::Mat& picture,
                                     const Intrinsics& in, const CameraFromModel& start) {
  const cv::Matx33d K(in.fl_x, 0, in.cx - 0.5, 0, in.fl_y, in.cy - 0.5, 0, 0, 1);
  const Eigen::Matrix3d R = start.rotation();
  const Eigen::Vector3d t = start.translation();
  cv::Matx33d rotation;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) rotation(r, c) = R(r, c);
  cv::Mat rvec, tvec = (cv::Mat_<double>(3, 1) << t.x(), t.y(), t.z());
  cv::Rodrigues(rotation, rvec);
  try {
    for (const int reach : kReaches_px) {
      tracker.clearState();
      const float matched = tracker.compute(
          picture, kLines, std::max(3, reach * picture.cols / 1848), K, rvec, tvec,
          cv::TermCriteria(cv::TermCriteria::MAX_ITER | cv::TermCriteria::EPS, kIterations, 1e-3));
      if (!(matched > 0)) return {};
    }
  } catch (const cv::Exception&) {
    return {};
  }
  cv::Rodrigues(rvec, rotation);
  Eigen::Matrix3d found;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) found(r, c) = rotation(r, c);
  return CameraFromModel(found, {tvec.at<double>(0), tvec.at<double>(1), tvec.at<double>(2)});
}

}  // namespace

PeerPoses SolveWithTracker(const PeerScene& scene, const TriangleMesh& mesh, Tracker which,
                           bool on_masks) {
  cv::Mat points(static_cast<int>(mesh.vertices.size()), 1, CV_32FC3);
  for (int i = 0; i < points.rows; ++i) {
    const Eigen::Vector3f v = mesh.vertices[static_cast<std::size_t>(i)].cast<float>();
    points.at<cv::Vec3f>(i) = {v.x(), v.y(), v.z()};
  }
  cv::Mat faces(static_cast<int>(mesh.faces.size()), 3, CV_32S);
  for (int i = 0; i < faces.rows; ++i)
    for (int k = 0; k < 3; ++k)
      faces.at<int>(i, k) =
          static_cast<int>(mesh.faces[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)]);
  PeerPoses result;
  result.method = std::string(NameOf(which)) + (on_masks ? ", silhouettes" : ", photographs");
  const double start = Seconds(), processor = ProcessorSeconds();
  const auto tracker = Make(which, points, faces);
  for (std::size_t i = 0; i < scene.pictures.size(); ++i) {
    cv::Mat silhouette;
    if (on_masks) cv::cvtColor(scene.trial.masks[i].coverage, silhouette, cv::COLOR_GRAY2BGR);
    result.poses.push_back(Track(*tracker, on_masks ? silhouette : scene.pictures[i],
                                 scene.trial.photos.intrinsics(scene.trial.photos.photos[i]),
                                 scene.start[i]));
  }
  result.seconds = Seconds() - start;
  result.processor_seconds = ProcessorSeconds() - processor;
  return result;
}

}  // namespace scan::bench
