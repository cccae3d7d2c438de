// Photographs onto the atlas: projection, seams, filling, provenance.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "acquisition/session/photo_set.h"
#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "reconstruction/masks/mask.h"
#include "reconstruction/mesh/atlas_mesh.h"
#include "reconstruction/pose/poses.h"

namespace scan {

enum class MergeMethod {
  best_view,  // every texel from the photograph that sees it most squarely
  seams,      // photograph after photograph joined along minimum cuts
};

// First channel of the provenance picture.
enum class TexelClass : std::uint16_t { none = 0, measured, blended, filled, synthesised };

constexpr std::uint16_t kNoView = 65535;

struct TextureOptions {
  int size_px = 2048;  // of the square atlas, [16, 16384]
  MergeMethod method = MergeMethod::seams;
  double max_incidence_deg = 80;  // texels seen more obliquely are not measured, (0, 90)
  int feather_texels = 2;         // either side of a seam is blended over this many, [0, 32]
  int smoothing_steps = 60;       // of filled texels, [0, 10000]
};

struct TextureReport {
  double measured_share = 0;  // of the surface area, measured or blended, [0, 1]
  std::vector<std::string> view_names;
  std::vector<double> view_share;  // of the surface area, per photograph of the set
  std::size_t seam_pairs = 0;      // neighbouring texels from two photographs
  double seam_cost = 0;            // sum of Eq 7 over all cuts made
  double project_seconds = 0, merge_seconds = 0, fill_seconds = 0;
};

struct TextureResult {
  cv::Mat albedo;      // CV_8UC3, BGR, sRGB, size_px x size_px; gutters are padded
  cv::Mat provenance;  // CV_16UC3 in memory order: class, view index (65535 none), 0.01 deg
  TextureReport report;
};

// Each accepted view (matched to the photo by name) is projected onto the atlas with its lens
// state's solved intrinsics, texels of which it does not see are filled from their neighbours on
// the surface. The view index of the provenance counts the photographs of the set. Preconditions:
// one mask per photo. Errors: bad_input for an atlas without faces or with uv outside [0, 1],
// options out of range, a photograph that cannot be read or has another size than its camera or
// mask, no accepted view; failed when no texel is seen; cancelled. Thread contract: parallel
// inside; same bytes for any number of threads; `progress` is called from the calling thread.
// Source: Ijiri 2018, texture reconstruction, Eq 7 and 8; Kwatra et al. 2003.
Result<TextureResult> MakeTexture(const AtlasMesh& atlas, const PhotoSet& photos,
                                  const Poses& poses, std::span<const Mask> masks,
                                  const TextureOptions& options = {},
                                  const ProgressFn& progress = {}, std::stop_token stop = {});

}  // namespace scan
