// Small silhouettes of the mesh over the viewing directions, and how far a photograph's contour is
// from them: shared by the searches for a start.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "drivers/base/intrinsics.h"
#include "reconstruction/mesh/mesh.h"
#include "reconstruction/pose/contour_evidence.h"

namespace scan::start {

constexpr int kSide = 72;            // px of a template
constexpr double kClip = 0.25;       // of a contour distance, in roots of the area
constexpr int kFieldSide = 112;      // px
constexpr float kStep = 1.0f / 512;  // of stored distances, in roots of the area

// Contour distances around a silhouette's centroid in units of the root of its area.
struct DistanceField {
  cv::Mat steps;    // CV_8U, kFieldSide squared, continuous; in kStep, clipped
  float scale = 1;  // px per unit
  float clip = static_cast<float>(kClip);  // outside of the field
};

struct Silhouette {
  DistanceField field;
  std::vector<Eigen::Vector2f> points;  // of the contour, about the centroid, in roots of the area
  double root_area = 0;                 // normalised image units
};

struct Template {
  Silhouette silhouette;
  Eigen::Matrix3d camera_from_model = Eigen::Matrix3d::Identity();  // rotation
  Eigen::Vector2d centroid =
      Eigen::Vector2d::Zero();  // from the mass centre, normalised image units
};

// `contour`: about the centroid, in roots of the area; `count` points of it are kept.
Silhouette MakeSilhouette(const std::vector<Eigen::Vector2f>& contour, double root_area, int count);

// The mesh seen from `direction` (unit length, model frame) at `distance_mm` from its mass centre;
// `closed` as in ContourMesh.
Template RenderTemplate(const TriangleMesh& mesh, bool closed, const Eigen::Vector3d& centre,
                        double radius_mm, const Eigen::Vector3d& direction, double distance_mm,
                        int count);

// A photograph's silhouette seen by the camera turned to its centroid; `turn` receives
// centred_from_camera.
Silhouette SilhouetteOf(const PhotoContour& photo, const Intrinsics& intrinsics, int count,
                        Eigen::Matrix3d& turn);

std::vector<Eigen::Vector2f> Rotated(const std::vector<Eigen::Vector2f>& points, double angle);

// Mean distance of the points to the field's contour, in roots of its area.
float MeanDistance(const DistanceField& field, const std::vector<Eigen::Vector2f>& points);

}  // namespace scan::start
