// One photograph without a logged pose: its camera from nothing, by its silhouette alone.
#pragma once

#include <stop_token>
#include <vector>

#include "reconstruction/pose/contour_evidence.h"
#include "reconstruction/pose/contour_sample.h"
#include "reconstruction/pose/joint_refine.h"
#include "reconstruction/pose/start_search.h"
#include "reconstruction/pose/start_templates.h"

namespace scan {

struct ViewStartOptions {
  int candidates = 32;         // of the templates' search, refined with a coarse mesh
  int finalists = 6;           // of these, refined with the full mesh; each also as its twins
  double distinct_rad = 0.25;  // between candidates
  double known_slack = 0.06;   // relative error of a stated distance that costs nothing
  double unknown_slack = 0.5;  // of one guessed from the silhouette's size
};

struct ViewCandidate {
  CameraFromModel camera_from_model;
  double misfit = 0;  // minus the log-likelihood, up to a constant common to a photograph
};

// Silhouettes of a mesh, rendered once and shared by all photographs.
// Thread contract: const calls from any thread. The mesh outlives this.
class ViewSearch {
 public:
  // `distance_mm` of the templates; 0: twenty radii of the mesh. Parallel inside.
  ViewSearch(const ContourMesh& mesh, double distance_mm, const StartOptions& search,
             const ViewStartOptions& options);
  ViewSearch(const ViewSearch&) = delete;
  ViewSearch& operator=(const ViewSearch&) = delete;

  // Poses that explain the photograph, best first, no two alike; empty when the contour is or when
  // stopped. Each template is compared at every angle, silhouette centroid on silhouette centroid,
  // its distance from the area; the best distinct ones are refined by Gauss-Newton on the contour,
  // and with them their twins: turned by 180 degrees about the line of sight and by 180 degrees
  // about a principal axis of the mesh, which a body with a plane of symmetry cannot be told from
  // but by perspective. `distance_mm`: stated, 0 when not known. px of `refine`: of this
  // photograph.
  std::vector<ViewCandidate> Solve(const PhotoContour& photo, const Intrinsics& intrinsics,
                                   double distance_mm, const RefineOptions& refine,
                                   std::stop_token stop) const;

 private:
  std::vector<CameraFromModel> Search(const PhotoContour& photo, const Intrinsics& intrinsics,
                                      double distance_mm) const;
  std::vector<CameraFromModel> TwinsOf(const PhotoContour& photo, const Intrinsics& intrinsics,
                                       const CameraFromModel& pose) const;

  const ContourMesh& mesh_;
  double distance_mm_;
  StartOptions search_;
  ViewStartOptions options_;
  TriangleMesh coarse_triangles_;
  ContourMesh coarse_;
  Eigen::Matrix3d principal_axes_;  // columns
  std::vector<start::Template> templates_;
};

// Gauss-Newton on one photograph's contour: find the contour generators, match, solve for the six
// pose parameters; again until nothing moves. Camera and mask bias of `state` stay. Thread
// contract: pure.
CameraFromModel RefineView(const ContourMesh& mesh, const PhotoContour& photo,
                           const ViewState& state, const RefineOptions& options);

}  // namespace scan
