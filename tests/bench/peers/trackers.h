// OpenCV's contour trackers (cv::rapid) on the same photographs, from the same poses.
#pragma once

#include "peer.h"

namespace scan::bench {

enum class Tracker { rapid, optimal_local, global_optimal };

// Each photograph alone from scene.start, search lines from wide to narrow. `on_masks`: the tracker
// sees the silhouette, white on black, instead of the photograph. `mesh`: what it projects.
PeerPoses SolveWithTracker(const PeerScene& scene, const TriangleMesh& mesh, Tracker tracker,
                           bool on_masks);

}  // namespace scan::bench
