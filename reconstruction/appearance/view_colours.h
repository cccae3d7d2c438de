// The colours that photographs show of the surface, on the nodes of a TurningGrid.
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "reconstruction/appearance/ring_map.h"
#include "reconstruction/masks/mask.h"

namespace scan {

// log(R/G), log(B/G) and log of the brightness, of linear light.
constexpr int kColourChannels = 3;
using ColourMaps = std::array<RingMap, kColourChannels>;  // weights alike in all

// One photograph on the surface, at its pose.
struct ViewColours {
  ColourMaps colour;
  std::vector<Eigen::Vector3f> normal;  // per node, camera frame
  std::vector<float> off_axis2;  // per node: squared distance from the picture's middle, as a
                                 // share of half its diagonal
  int lighting = 0;              // views alike here stand in the same light
};

struct ViewColourOptions {
  double least_cosine = 0.35;  // of the angle between the normal and the line of sight
  int longest_side_px = 1848;  // larger photographs are averaged down to that
  double darkest = 0.004;      // linear; below, a pixel tells no colour
  double brightest = 0.97;     // linear; above, it is clipped
};

// A node is seen when it faces the camera, its pixel lies a pixel and a half inside the mask and
// nothing of the mesh is nearer. `photo`: CV_8UC3, BGR, sRGB, at the size of `intrinsics`; so is
// the mask. Thread contract: pure; parallel inside; the same bytes for any number of threads.
ViewColours BackProject(const TurningGrid& grid, const TriangleMesh& mesh, const cv::Mat& photo,
                        const Mask& mask, const CameraFromModel& camera_from_model,
                        const Intrinsics& intrinsics, const ViewColourOptions& options = {});

// Takes the light off, in place: what is smooth in the normal seen from the camera (spherical
// harmonics to order two) and towards the picture's corners, alike for the views of one `lighting`,
// and each view's own brightness. It is found from the differences between views of the same node,
// so that it takes nothing of the surface's own colour along; without overlap nothing is taken off.
void LevelLight(std::span<ViewColours> views);

// Weighted mean of all views.
ColourMaps Merged(std::span<const ViewColours> views);

// How well views agree where they overlap.
struct Agreement {
  double share = 0;     // of the colour's variance that the views have in common, mean of channels
  double overlaps = 0;  // nodes that at least two views see, as a share of those that one sees
  std::array<double, kColourChannels> noise{};  // standard deviation of one view about the mean
};
Agreement AgreementOf(std::span<const ViewColours> views);

}  // namespace scan
