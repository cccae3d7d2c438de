// Parts of the specimen that were bent since the CT: a leg that stands elsewhere in all photographs
// than in the mesh.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "reconstruction/pose/joint_refine.h"

namespace scan {

struct BentPart {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // model frame, mm
  Eigen::Vector3d tip = Eigen::Vector3d::Zero(), hinge = Eigen::Vector3d::Zero();
  double length_mm = 0;    // along the surface from its tip to where it bends
  double distance_px = 0;  // RMS of its outlines from those of the mesh
  int views = 0;           // that show it off
  // Of the vertices, and how far each goes along: 1, and less towards the hinge.
  std::vector<std::pair<std::uint32_t, double>> vertices;
  // Where it went: x -> hinge + rotation (x - hinge) + shift_mm.
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();
};

struct BentPartOptions {
  double least_sigmas = 3;       // RMS of the outlines there, in scales of all residuals
  double least_explained = 0.7;  // of the squared residuals there, by one motion about a hinge
  double least_gain = 30;        // of the log-likelihood, in units of the scatter that remains
  int least_views = 3;           // that show it off: one view's outline can be wrong by itself
  double most_share = 0.35;      // of the surface, and of all contour: beyond, it is no part
  // Priors of the motion: bends are across the part, which hardly turns about its own length nor
  // goes along at the hinge.
  double bend_sigma_rad = 0.3, twist_sigma_rad = 0.02;
  double hinge_sigma_share = 0.03;  // of the part's length
};

// Parts are what lies within a geodesic distance of a tip of the surface, out to where they bend.
// For each tip and each distance one rigid motion about the hinge is fitted to the residuals of all
// views; a part is bent where that explains them and they are large. A mask that is too wide or
// a threshold that was wrong moves outlines outward on all sides and is explained by no motion.
// `fits`: at the solved pose, with a window that reaches the bent part. Most telling first.
// Thread contract: pure.
std::vector<BentPart> FindBentParts(const ContourMesh& mesh, std::span<const ViewFit> fits,
                                    const BentPartOptions& options);

// Moves each part on by what `fits`, of `bent` = the mesh with the parts as they are, still leave.
void RefineBends(const ContourMesh& bent, std::span<const ViewFit> fits,
                 const BentPartOptions& options, std::vector<BentPart>& parts);

// The mesh with its parts where they went.
TriangleMesh WithBends(const TriangleMesh& mesh, std::span<const BentPart> parts);

// A sentence for the report.
std::string BentPartNote(const BentPart& part);

}  // namespace scan
