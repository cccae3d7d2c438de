// What cameras see of beads on a specimen, and which patch of colour is which bead.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "reconstruction/fiducials/bead.h"
#include "reconstruction/mesh/bvh.h"
#include "reconstruction/pose/bead_sighting.h"
#include "reconstruction/pose/contour_evidence.h"

namespace scan {

// A bead as a camera sees it: what the specimen leaves of its image.
struct BeadAppearance {
  Eigen::Vector2d whole = Eigen::Vector2d::Zero();     // middle of the whole ball's image, px
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();  // of what is seen
  double radius_px = 0;                                // of the whole
  double share = 0;                                    // of the whole's area that is seen
  double area_px() const;                              // seen
};

// Rays are asked of the mesh, whether the beads are part of it or not. Thread contract: const calls
// from any thread. `mesh` and `beads` outlive this.
class BeadScene {
 public:
  BeadScene(const TriangleMesh& mesh, std::span<const Bead> beads) : bvh_(mesh), beads_(beads) {}

  std::span<const Bead> beads() const { return beads_; }
  // `samples`: rays along a diameter. Nothing for a ball that is not wholly in the picture.
  std::optional<BeadAppearance> Appearance(std::size_t bead, const ViewState& state,
                                           int samples) const;

 private:
  MeshBvh bvh_;
  std::span<const Bead> beads_;
};

struct BeadMatchOptions {
  double sigma_px = 0.15;     // of a bead's image; what is hidden of it adds to it
  double least_share = 0.4;   // of a bead that must be seen
  double clear_share = 0.55;  // of a bead that should be recognised
  double area_factor = 1.7;   // largest ratio of areas, either way
  double reach_radii = 2;     // between where a bead should be and where it is
  double least_reach_px = 1.5;
  int samples = 15;
};

struct BeadMatches {
  std::vector<BeadSighting> sightings;  // CT centres count as exact
  std::vector<int> expected;            // indices of beads that should be recognised
  std::size_t strangers = 0;            // patches where no bead is, those cut by the border apart
};

// Nearest pairs first. The target of a sighting is the patch's centroid, moved by as much as what
// is hidden moves the bead's; so no image needs to be an ellipse. Beads with left_out[i] take no
// part.
BeadMatches MatchBeads(const BeadScene& scene, std::span<const BeadImage> images,
                       const ViewState& state, const std::vector<bool>& left_out,
                       const BeadMatchOptions& options);

}  // namespace scan
