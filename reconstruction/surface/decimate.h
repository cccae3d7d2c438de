// Fewer faces for the same shape.
#pragma once

#include <cstddef>

#include "drivers/base/result.h"
#include "reconstruction/mesh/mesh.h"

namespace scan {

struct DecimateOptions {
  std::size_t faces = 50000;  // aimed at; >= 4
};

struct Decimation {
  TriangleMesh mesh;
  double quadric_error_mm = 0;  // the simplifier's own estimate of its largest step
  double max_deviation_mm = 0;  // from the original's vertices (a sample of up to 40,000 of them)
  double rms_deviation_mm = 0;  // to the new surface, measured
};

// Quadric edge collapse to about `faces` faces, made a closed manifold again; a mesh with no more
// faces than that comes back as it is. Vertices stay where they were (a subset of the original's).
// Where collapses meet in a thin place and pinch it off, the faces about it are kept and the rest
// is reduced again: components and handles stay. Precondition: closed manifold. Errors: failed when
// the result is no closed manifold. Thread contract: pure. Source: Garland, Heckbert 1997
// (meshoptimizer).
Result<Decimation> Decimate(const TriangleMesh& mesh, const DecimateOptions& options = {});

}  // namespace scan
