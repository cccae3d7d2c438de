// Whether a view's silhouette is explained by its pose, both ways.
#pragma once

#include <string>

#include "reconstruction/pose/joint_refine.h"

namespace scan {

struct AcceptanceOptions {
  double explained = 0.8;       // least share of either contour
  double sigmas = 3;            // what counts as explained
  double sigma_floor_px = 0.5;  // at 1848 px; never finer than this
  double prior_chi2 = 26.12;    // 99.9 % for the 8 deviations of a view
};

struct Explained {
  double photo_share = 0;      // of the photo's contour, flagged pieces left out
  double model_share = 0;      // of the model's visible contour, what is thinner than 1 px left out
  double rms_px = 0;           // of the residuals that count as explained
  bool sees_anything = false;  // a part of the model's contour is in the picture
};
// `tolerance_px`: distance that still counts.
Explained ExplainedShares(const ContourMesh& mesh, const PhotoContour& photo,
                          const ViewState& state, double tolerance_px, double spacing_px);

// Mean distance between the two contours along their normals, each piece's clipped at `clip_px`,
// half from the model to the photo and half from the photo to the model: what tells candidates
// apart, whatever they leave unexplained. `clip_px` when either contour is empty.
double TwoWayDistance(const ContourMesh& mesh, const PhotoContour& photo, const ViewState& state,
                      double clip_px, double spacing_px);

// Minus the log-likelihood of the pose, up to a constant: half of the squared distances over sigma
// squared, both ways (the mean of the two), each clipped at ten sigmas, with `correlation_px` of
// contour as one independent observation.
double Misfit(const ContourMesh& mesh, const PhotoContour& photo, const ViewState& state,
              double sigma_px, double correlation_px, double spacing_px);

// Empty when accepted, else the reason in one sentence.
std::string RejectionReason(const Explained& explained, double view_prior_chi2,
                            const AcceptanceOptions& options);

}  // namespace scan
