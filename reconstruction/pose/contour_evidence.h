// What one photograph's contour says about its camera: residuals along the contour's normals, and
// their condensation into one small quadratic form.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "reconstruction/masks/contour.h"
#include "reconstruction/masks/mask.h"
#include "reconstruction/pose/bead_sighting.h"
#include "reconstruction/pose/contour_grid.h"
#include "reconstruction/pose/contour_sample.h"

namespace scan {

// A photograph's contour, prepared once, and the beads that were recognised in it.
struct PhotoContour {
  ContourGrid grid;                  // every segment, flagged ones too
  std::vector<double> arc_px;        // of each segment's start, along all contours; far between two
  cv::Mat ignore;                    // CV_8U or empty: non-zero = no evidence here
  std::vector<ContourPoint> points;  // evidence only, about 2 px apart
  double length_px = 0;              // of evidence
  double area_px = 0;
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  double diameter_px = 0;  // of the contour's bounding box
  bool touches_border = false;
  bool binary = false;
  std::vector<BeadSighting> beads;

  bool empty() const { return points.empty(); }
};
PhotoContour MakePhotoContour(const Mask& mask);

// What a contour residual depends on, in this order: a motion of the body about a pivot in the
// camera frame (w rad, tau mm), the log of the focal length, the principal point (px), the mask
// bias (px, outward positive), the radial distortion at the picture's corner (relative, see
// K1OfCorner).
constexpr int kEvidenceSize = 11;
using EvidenceVector = Eigen::Matrix<double, kEvidenceSize, 1>;
using EvidenceMatrix = Eigen::Matrix<double, kEvidenceSize, kEvidenceSize>;

// The pose and camera that a condensation is linearised about.
struct ViewState {
  CameraFromModel camera_from_model;
  Intrinsics intrinsics;
  double mask_bias_px = 0;
};

// Signed distance in px from the image of `point` to `target` along `normal`, less the mask bias:
// r = n . (q - u(x)) - b. The point is fixed on the surface: it is a contour generator, so that its
// own sliding moves its image along the contour only, to first order. `dr`, when given, receives
// the derivative; `pivot` is in the camera frame.
double ContourResidual(const ViewState& state, const Eigen::Vector3d& point,
                       const Eigen::Vector2d& target, const Eigen::Vector2d& normal,
                       const Eigen::Vector3d& pivot, EvidenceVector* dr);

struct ContourMatch {
  Eigen::Vector3d point;   // model frame, mm
  Eigen::Vector2d target;  // on the photo's contour
  Eigen::Vector2d normal;
  double residual_px = 0;  // bias taken off
  double length_px = 0;
  std::array<std::uint32_t, 2> vertices{};  // of the mesh edge the point lies on
  double arc_px = 0;                        // place of `target` along the photo's contour
  double share_px = 0;  // of the photo's contour that is nearer to this target than to others
};

struct MatchResult {
  std::vector<ContourMatch> matches;
  double unmatched_px = 0;  // model contour without a partner in the window
  double MatchedLength() const;
};

// Partners along the model's image normal, within +-window_px of where the mask bias puts them,
// normals within 60 degrees, so that the far side of a thin leg is never taken. Flagged pieces of
// the photo's contour are neither partners nor missing ones, and a sample in an ignored region
// needs none. Every piece of the photo's contour is shared out once, however many folds of the mesh
// lie along it: where edges zigzag along an outline, samples come in heaps.
MatchResult MatchContour(std::span<const ContourSample> samples, const PhotoContour& photo,
                         double mask_bias_px, double window_px);

// 1.4826 x median |residual|; 0 without matches.
double RobustSigma(std::span<const ContourMatch> matches);

struct EvidenceWeights {
  double sigma_px = 1;          // of one residual
  double correlation_px = 43;   // of contour that counts as one independent observation
  double tukey_sigmas = 4.685;  // beyond this a match counts nothing
  // What the model lacks at a place of the surface and views that see it share, standard deviation;
  // 0: nothing.
  double discrepancy_px = 0;
  double place_mm = 1;  // width of a place
};

// Cube of a grid in the model frame, and the side that the surface turns there (0 to 5: the
// largest component of its normal and that one's sign).
using SurfacePlace = std::array<int, 4>;
// Precondition: place_mm > 0. Thread contract: pure.
SurfacePlace PlaceOf(const ViewState& state, const ContourMatch& match, double place_mm);

// Independent observations that a match of this residual stands for, over sigma^2.
double WeightOf(const ContourMatch& match, double residual_px, const EvidenceWeights& weights);

// What a view knows of the discrepancy d at one place, in units of its standard deviation:
// 1/2 D d^2 + d (C' y + g).
struct PlaceEvidence {
  SurfacePlace place{};
  double D = 0;
  EvidenceVector C = EvidenceVector::Zero();
  double g = 0;
};

// 1/2 y' H y + g' y + constant of y = (motion, log focal, principal point, bias, distortion) -
// (0, state).
// H and g are those of the view alone: minimised over the discrepancies, 1/2 d^2 each besides.
struct CondensedEvidence {
  ViewState state;
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();  // camera frame
  EvidenceMatrix H = EvidenceMatrix::Zero();
  EvidenceVector g = EvidenceVector::Zero();
  double weight = 0;                  // sum of weights times sigma^2: independent observations
  std::vector<PlaceEvidence> places;  // in order; for those who see one in several views
};
CondensedEvidence Condense(const ViewState& state, std::span<const ContourMatch> matches,
                           const Eigen::Vector3d& pivot, const EvidenceWeights& weights);

}  // namespace scan
