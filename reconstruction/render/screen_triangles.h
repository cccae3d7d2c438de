// Internal to the rasteriser: triangles in fixed-point pixels, sorted into bands of rows.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "drivers/base/frames.h"
#include "drivers/base/intrinsics.h"
#include "reconstruction/mesh/mesh.h"

namespace scan::render {

// Sub-pixel positions are multiples of 2^-12 px. With |x| <= 2^15 px an edge function stays below
// 2^58 and is exact in 64 bits.
constexpr int kSubPixelBits = 12;
constexpr std::int64_t kSubPixel = std::int64_t{1} << kSubPixelBits;
constexpr double kGuardBand_px = 32767;
constexpr double kNear_mm = 1e-3;
constexpr int kBandRows = 32;

// Corners run so that the inside of every edge a -> b has a positive edge function
// dx (y - ay) - dy (x - ax). Inverse depth is linear in the picture.
struct ScreenTriangle {
  std::array<std::int32_t, 3> x, y;  // in 2^-12 px
  double inverse_depth;              // at corner 0, 1/mm
  double dinverse_depth_dx, dinverse_depth_dy;
  float inverse_depth_min, inverse_depth_max;
  std::int32_t face;
};

// Faces of one run of indices; `band_first` and `order` list the triangles of each band.
struct TriangleChunk {
  std::vector<ScreenTriangle> triangles;  // by rising face index
  std::vector<std::uint32_t> band_first;  // bands + 1 entries into `order`
  std::vector<std::uint32_t> order;
};

struct ScreenTriangles {
  int w = 0, h = 0, bands = 0;
  std::vector<TriangleChunk> chunks;
};

// Projects, clips and sorts. Faces with a corner where the lens distortion folds over are dropped.
ScreenTriangles ProjectTriangles(const TriangleMesh& mesh, const CameraFromModel& camera_from_model,
                                 const Intrinsics& intrinsics);

// The three edges of a triangle, ready to be cut with rows.
class RowCutter {
 public:
  explicit RowCutter(const ScreenTriangle& t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t n = k == 2 ? 0 : k + 1;
      Edge& e = edges_[k];
      e.ax = t.x[k];
      e.ay = t.y[k];
      e.dx = t.x[n] - e.ax;
      e.dy = t.y[n] - e.ay;
      // Top-left rule: a sample on an edge belongs to the triangle to its right or below it.
      const bool top_left = e.dy < 0 || (e.dy == 0 && e.dx > 0);
      e.bias = top_left ? 0 : 1;
      e.abs_dy = static_cast<double>(e.dy < 0 ? -e.dy : e.dy);
    }
  }

  // Samples lie at i + x_offset, i in [0, w), on the row at `y`, all in 2^-12 px. False if none is
  // covered.
  bool Cut(std::int64_t y, std::int64_t x_offset, int w, int& first, int& last) const {
    int lo = 0, hi = w - 1;
    for (const Edge& e : edges_) {
      const std::int64_t c = e.dx * (y - e.ay) - e.dy * (x_offset - e.ax) - e.bias;
      if (e.dy == 0) {
        if (c < 0) return false;
        continue;
      }
      // floor(c / (2^12 |dy|)) as floor(floor(c / 2^12) / |dy|): both below 2^53, and a quotient
      // within the guard band lies further than a rounding error from the next integer.
      const double quotient = static_cast<double>(c >> kSubPixelBits) / e.abs_dy;
      const double bounded = quotient < -1e6 ? -1e6 : (quotient > 1e6 ? 1e6 : quotient);
      int q = static_cast<int>(bounded);
      q -= q > bounded;
      if (e.dy > 0) {
        hi = q < hi ? q : hi;
      } else {
        lo = -q > lo ? -q : lo;
      }
    }
    first = lo;
    last = hi;
    return lo <= hi;
  }

 private:
  struct Edge {
    std::int64_t ax, ay, dx, dy, bias;
    double abs_dy;
  };
  std::array<Edge, 3> edges_;
};

}  // namespace scan::render
