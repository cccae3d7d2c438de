// Real photographs with nominal poses only: principal point 3.3 px off, axis tilted by 1.72
// degrees.
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <opencv2/imgproc.hpp>

#include "drivers/base/units.h"
#include "reconstruction/pose/rigid_motion.h"
#include "reconstruction/pose/score.h"
#include "reconstruction/pose/solve_joint.h"
#include "squirrel.h"

namespace scan {
namespace {

TEST(SquirrelPose, AgreesWithTheCalibratedCameras) {
  auto squirrel =
      test::LoadSquirrel(std::string(SCAN_SOURCE_DIR) + "/../shared/data/squirrel_turntable");
  if (!squirrel) GTEST_SKIP() << "the data folder is not here";
  // The dark base makes the lowest 12 % of the silhouettes unreliable.
  for (Mask& mask : squirrel->masks) {
    const cv::Rect box = [&] {
      cv::Mat points;
      cv::findNonZero(mask.coverage, points);
      return cv::boundingRect(points);
    }();
    mask.ignore = cv::Mat(mask.coverage.size(), CV_8U, cv::Scalar(0));
    const int top = box.y + static_cast<int>(0.88 * box.height);
    mask.ignore.rowRange(top, mask.ignore.rows).setTo(255);
  }
  const auto poses = SolveJoint(squirrel->mesh, squirrel->photos, squirrel->masks, {});
  ASSERT_TRUE(poses) << ToString(poses.error());
  for (const std::string& note : poses->notes)  // the rig did its work
    for (const char* fault : {"stands", "moved", "other way", "differs", "bent"})
      EXPECT_EQ(note.find(fault), std::string::npos) << note;

  // The scan's own frame differs from the calibration's by one rotation.
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const ViewPose& view : poses->views)
    sum += squirrel->truth.at(view.name).rotation().transpose() * view.camera_from_model.rotation();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d alignment = svd.matrixU() * svd.matrixV().transpose();
  std::vector<double> aligned_deg, neighbour_deg, rms_px;
  for (std::size_t i = 0; i < poses->views.size(); ++i) {
    const ViewPose& view = poses->views[i];
    EXPECT_EQ(view.status, ViewStatus::accepted) << view.name << ": " << view.reason;
    const ViewPose& next = poses->views[(i + 1) % poses->views.size()];
    const Eigen::Matrix3d truth = squirrel->truth.at(view.name).rotation();
    const Eigen::Matrix3d next_truth = squirrel->truth.at(next.name).rotation();
    aligned_deg.push_back(
        DegFromRad(AngleBetween(truth * alignment, view.camera_from_model.rotation())));
    neighbour_deg.push_back(DegFromRad(AngleBetween(
        next_truth * truth.transpose(),
        next.camera_from_model.rotation() * view.camera_from_model.rotation().transpose())));
    rms_px.push_back(view.contour_rms_px);
  }
  EXPECT_LT(SpreadOf(aligned_deg).max, 1.2);
  EXPECT_LT(SpreadOf(neighbour_deg).median, 0.4);
  EXPECT_LT(SpreadOf(rms_px).median, 1.5);
  for (const auto& [name, estimate] : poses->lens_states.at("lens").parameters) {
    const double nominal = name == "cx"   ? squirrel->photos.lens_states[0].intrinsics.cx
                           : name == "cy" ? squirrel->photos.lens_states[0].intrinsics.cy
                                          : 0;
    EXPECT_LT(std::abs(estimate.value - nominal), 3 * estimate.sigma) << name;
  }
}

}  // namespace
}  // namespace scan
