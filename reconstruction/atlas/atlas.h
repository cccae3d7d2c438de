// Surface to atlas: near-flat charts, unfolded and packed into one square texture.
#pragma once

#include <cstddef>
#include <stop_token>

#include "drivers/base/progress.h"
#include "drivers/base/result.h"
#include "reconstruction/mesh/atlas_mesh.h"

namespace scan {

enum class UnfoldMethod {
  lscm,  // least squares conformal maps (Levy et al. 2002)
  arap,  // as rigid as possible (Liu et al. 2008): less stretch, several times slower
};

struct AtlasOptions {
  int size_px = 2048;  // [64, 16384]
  UnfoldMethod method = UnfoldMethod::lscm;
  int padding_px = 4;  // least distance of two charts, [0, 64]
  double max_stretch =
      2.5;  // of a chart's worst percent of area, > 1: beyond it the chart is split
};

// Stretch is Sander et al. 2001 on charts of uniform texel density: 1 is an isometry.
struct AtlasReport {
  std::size_t charts = 0;
  std::size_t degenerate_faces = 0;  // without an area; they share one point of a neighbour's chart
  double texels_per_mm = 0;
  double stretch_l2 = 0;  // root mean square over the surface
  // Largest singular value that this share of the surface's area stays below.
  double stretch_median = 0, stretch_p95 = 0;
  double stretch_p99 = 0;     // largest singular value, worst percent of the surface left out
  double stretch_max = 0;     // largest singular value of any face
  double texel_usage = 0;     // share of the square that the charts' faces cover, [0, 1]
  double padding_usage = 0;   // share that half the padding along every border takes, about
  double seam_length_mm = 0;  // edges between two charts, once each
};

struct AtlasResult {
  AtlasMesh atlas;  // faces in the order of the input's
  AtlasReport report;
};

// Takes any mesh: open, non-manifold and inconsistently oriented ones too. Every face with an area
// gets a chart and an area in the picture; charts are topological disks, none overlaps itself or
// another. Same input, same bytes, for any number of threads.
// Errors: bad_input for a mesh without any face with an area, options out of range, or more charts
// than fit into size_px; cancelled.
// Thread contract: pure; parallel inside. `progress` is called from the calling thread.
// A chart that cannot be unfolded within max_stretch is halved; small ones then join neighbours
// where both unfold together. Pits of less than 5e-5 of the surface may stretch at will.
// Source: clusters by Ward's criterion on normals (after Cohen-Steiner et al. 2004, Garland et al.
// 2001), unfolding by CGAL, where that fails as rigid as possible, packing as xatlas does on
// bitmaps.
Result<AtlasResult> MakeAtlas(const TriangleMesh& mesh, const AtlasOptions& options,
                              const ProgressFn& progress = {}, std::stop_token stop = {});

}  // namespace scan
