// The texels that show surface, in a row, with what the stages need of each.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "reconstruction/atlas/texel_map.h"
#include "reconstruction/mesh/atlas_mesh.h"

namespace scan {

struct Texels {
  int size_px = 0;
  std::vector<std::int32_t> place;        // row * size_px + column in the atlas, ascending
  std::vector<Eigen::Vector3f> position;  // mm, model frame
  std::vector<Eigen::Vector3f> normal;    // unit length or zero
  std::vector<float> area_mm2;
  std::vector<float> side_mm;  // of the texel on the surface
  // Neighbours on the surface: four in the atlas within the chart (-1 none) and those across seams.
  std::vector<std::array<std::int32_t, 4>> beside;
  std::vector<std::int32_t> link_begin;  // into link; size() + 1 entries
  std::vector<std::int32_t> link;

  std::size_t size() const { return place.size(); }

  template <class Visit>
  void VisitNeighbours(std::size_t i, Visit&& visit) const {
    for (const std::int32_t j : beside[i]) {
      if (j >= 0) visit(j);
    }
    for (std::int32_t k = link_begin[i]; k < link_begin[i + 1]; ++k) visit(link[k]);
  }
};

Texels MakeTexels(const AtlasMesh& atlas, const TexelMap& map);

// Colour of every texel: sRGB codes times 257 (BGR).
using Colour16 = cv::Vec<std::uint16_t, 3>;

Colour16 CodesOfLinear(const cv::Vec3f& linear);
cv::Vec3f LinearOfCodes(const Colour16& codes);

// What one photograph, or all so far, give to each texel.
struct Layer {
  std::vector<Colour16> colour;
  std::vector<float> cosine;        // of the incidence; 0: not seen
  std::vector<std::uint16_t> view;  // kNoView: not seen
  std::vector<std::uint16_t> kind;  // TexelClass
};

Layer MakeLayer(std::size_t texels);

}  // namespace scan
