// Which surface point each texel of an atlas shows, and which texels meet across its seams.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "reconstruction/mesh/atlas_mesh.h"

namespace scan {

enum class TexelKind : std::uint8_t {
  empty = 0,   // far from every chart
  inside = 1,  // its centre lies in a face, or it is the only texel of a face too small for one
  gutter = 2,  // beside a chart: shows the nearest surface point of that chart
};

// Two texels of kind `inside` that are neighbours on the surface but not in the atlas; index =
// row * size_px + column, a < b.
struct SeamLink {
  std::int32_t a = 0, b = 0;
  friend auto operator<=>(const SeamLink&, const SeamLink&) = default;
};

// All pictures are size_px x size_px.
struct TexelMap {
  int size_px = 0;
  cv::Mat face;         // CV_32S, index into atlas.mesh.faces; -1 where empty
  cv::Mat barycentric;  // CV_32FC2, weights of corners 1 and 2 (corner 0 has the rest), in [0, 1]
  cv::Mat kind;         // CV_8U, TexelKind
  std::vector<SeamLink> seam_links;  // sorted, each pair once
};

// Rasterises the faces in texture space at texel centres; where faces overlap or touch the lowest
// index wins. Gutter texels, up to `gutter_px` away (at least 0), get the nearest point of the
// nearest face among those of their neighbours.
// Precondition: size_px in [1, 32768], uv in [0, 1].
// Thread contract: pure.
TexelMap MakeTexelMap(const AtlasMesh& atlas, int size_px, int gutter_px = 2);

// The surface point of a texel (column, row), mm in the model frame.
// Precondition: the texel is not empty.
Eigen::Vector3d SurfacePoint(const AtlasMesh& atlas, const TexelMap& map, int column, int row);

}  // namespace scan
