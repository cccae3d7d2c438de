// The pictures of the report that show poses: where the cameras stand and how well that is known.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/pose/poses.h"

namespace scan {

// The largest of 1, 2 and 5 times a power of ten that is not above `value`; 1 for what is not
// positive and finite.
double RoundFactor(double value);

// One camera of the ring; model frame, mm.
struct RingCamera {
  std::string label;                                   // the view's place in the list, from 1
  std::optional<Eigen::Vector3d> nominal;              // centre as logged, with the solved mounting
  std::optional<Eigen::Vector3d> solved;               // centre
  Eigen::Vector3d forward = Eigen::Vector3d::UnitZ();  // solved viewing direction, unit length
  bool accepted = false;
};

// One camera per view that has a solved pose. Precondition: as many views as photographs.
std::vector<RingCamera> RingOf(const PhotoSet& photos, const Poses& poses);

// The direction of the turntable's axis in the model frame, of the first mounting; without logged
// poses the mean direction of the pictures' upper edges. Unit length.
Eigen::Vector3d UpInModel(const PhotoSet& photos, const Poses& poses);

// Parallel projection of the model frame into a picture.
struct ParallelView {
  Eigen::Vector3d right = Eigen::Vector3d::UnitX(), up = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // drawn at `middle_px`
  Eigen::Vector2d middle_px = Eigen::Vector2d::Zero();
  double px_per_mm = 1;

  Eigen::Vector2d operator()(const Eigen::Vector3d& point) const {
    return middle_px +
           px_per_mm * Eigen::Vector2d(right.dot(point - centre), -up.dot(point - centre));
  }
};

struct RingPicture {
  cv::Mat picture;      // BGR; empty when there is no camera to draw
  double enlarged = 1;  // solved centres are drawn this many times as far from the nominal ones
  ParallelView view;    // solved centre of the picture: nominal + enlarged (solved - nominal)
};

// Seen from obliquely above, `side_px` wide: nominal centres hollow, solved ones filled (red when
// rejected) with their viewing direction, the mesh as a cloud, its axes with their length in mm,
// free rotations as a dashed axis with an arrow round it. What is not finite is left out.
RingPicture DrawRing(std::span<const RingCamera> cameras, const TriangleMesh& mesh,
                     std::span<const FreeDirection> free_directions, const Eigen::Vector3d& up,
                     int side_px);

// Where a point of the surface is seen and how well that is known.
struct SurfaceEllipse {
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d covariance_px2;
};

// Of visible points of the mesh, about `across` in the longer direction of the specimen's picture.
// Under `covariance_with_lens` of the view where it is there, else under its pose's alone.
// Points whose picture is not finite are left out. Thread contract: pure.
std::vector<SurfaceEllipse> SurfaceEllipses(const TriangleMesh& mesh, const ViewPose& view,
                                            const Intrinsics& intrinsics, int across);

// The factor that makes the larger half axes of the middle ellipse about `half_axis_px` long.
double EllipseFactor(std::span<const SurfaceEllipse> ellipses, double half_axis_px);

// 1-sigma ellipses, enlarged by `factor`, over a dimmed BGR picture; centres in its pixels.
cv::Mat DrawEllipses(const cv::Mat& picture, std::span<const SurfaceEllipse> ellipses,
                     double factor);

}  // namespace scan
