#include "reconstruction/render/rasterise.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <vector>

#include "reconstruction/render/screen_triangles.h"

namespace scan {
namespace {

using render::kBandRows;
using render::kSubPixel;
using render::kSubPixelBits;
using render::RowCutter;
using render::ScreenTriangle;
using render::ScreenTriangles;

struct Rows {
  int first, end;
};

// Rows of a triangle within a band; its corners may lie far outside of the picture.
Rows RowsInBand(const ScreenTriangle& t, Rows band) {
  const auto [low, high] = std::minmax({t.y[0], t.y[1], t.y[2]});
  return {std::max(band.first, low >> kSubPixelBits),
          std::min(band.end, (high >> kSubPixelBits) + 1)};
}

// Calls visit(triangle) in the order of the faces, which decides ties the same way for any number
// of threads.
template <class Visit>
void ForTrianglesOfBand(const ScreenTriangles& screen, int band, Visit visit) {
  const auto b = static_cast<std::size_t>(band);
  for (const render::TriangleChunk& chunk : screen.chunks) {
    for (std::uint32_t k = chunk.band_first[b]; k < chunk.band_first[b + 1]; ++k) {
      visit(chunk.triangles[chunk.order[k]]);
    }
  }
}

void DrawDepth(const ScreenTriangle& t, Rows rows, cv::Mat& inverse_depth, cv::Mat& face) {
  const RowCutter cutter(t);
  constexpr double kPixel = 1.0 / static_cast<double>(kSubPixel);
  for (int row = rows.first; row < rows.end; ++row) {
    int first, last;
    if (!cutter.Cut(row * kSubPixel + kSubPixel / 2, kSubPixel / 2, inverse_depth.cols, first,
                    last)) {
      continue;
    }
    const double start = t.inverse_depth + t.dinverse_depth_dy * (row + 0.5 - t.y[0] * kPixel) +
                         t.dinverse_depth_dx * (first + 0.5 - t.x[0] * kPixel);
    float* depths = inverse_depth.ptr<float>(row) + first;
    std::int32_t* faces = face.ptr<std::int32_t>(row) + first;
    for (int i = 0; i <= last - first; ++i) {
      // Rounding must not carry a sliver's depth beyond its corners.
      const float value = std::min(
          std::max(static_cast<float>(start + i * t.dinverse_depth_dx), t.inverse_depth_min),
          t.inverse_depth_max);
      if (value > depths[i]) {
        depths[i] = value;
        faces[i] = t.face;
      }
    }
  }
}

// n = samples^2 points of a rank-1 lattice: one point in each of n rows and of n columns of a
// pixel, so that edges along the axes are resolved to 1/n; the multiplier with the widest spacing.
std::vector<std::int64_t> LatticeOffsets(int n) {
  const auto spacing2 = [n](int a) {
    double best = std::numeric_limits<double>::infinity();
    for (int j = 1; j < n; ++j) {
      const int column = (j * a) % n;
      const double dx = std::min(column, n - column), dy = std::min(j, n - j);
      best = std::min(best, dx * dx + dy * dy);
    }
    return best;
  };
  int multiplier = 1;
  double widest = 0;
  for (int a = 1; a < n; ++a) {
    if (std::gcd(a, n) != 1) continue;
    if (const double spacing = spacing2(a); spacing > widest) {
      widest = spacing;
      multiplier = a;
    }
  }
  std::vector<std::int64_t> offsets;
  for (int j = 0; j < n; ++j) {
    offsets.push_back((2 * ((j * multiplier) % n) + 1) * kSubPixel / (2 * n));
  }
  return offsets;
}

void DrawSamples(const ScreenTriangle& t, Rows rows, int band_first_row,
                 const std::vector<std::int64_t>& x_offsets, cv::Mat& hits) {
  const RowCutter cutter(t);
  const auto n = static_cast<std::int64_t>(x_offsets.size());
  const auto [low, high] = std::minmax({t.y[0], t.y[1], t.y[2]});
  for (int row = rows.first; row < rows.end; ++row) {
    for (std::int64_t j = 0; j < n; ++j) {
      const std::int64_t y = row * kSubPixel + (2 * j + 1) * kSubPixel / (2 * n);
      if (y < low || y > high) continue;
      int first, last;
      if (!cutter.Cut(y, x_offsets[static_cast<std::size_t>(j)], hits.cols, first, last)) continue;
      const auto line = (row - band_first_row) * n + j;
      std::memset(hits.ptr<std::uint8_t>(static_cast<int>(line)) + first, 1,
                  static_cast<std::size_t>(last - first + 1));
    }
  }
}

}  // namespace

Raster Rasterise(const TriangleMesh& mesh, const CameraFromModel& camera_from_model,
                 const Intrinsics& intrinsics) {
  const ScreenTriangles screen = render::ProjectTriangles(mesh, camera_from_model, intrinsics);
  Raster raster;
  raster.depth_mm.create(intrinsics.h, intrinsics.w, CV_32F);
  raster.face.create(intrinsics.h, intrinsics.w, CV_32S);
  tbb::parallel_for(0, screen.bands, [&](int band) {
    const Rows rows{band * kBandRows, std::min(intrinsics.h, (band + 1) * kBandRows)};
    // Holds 1/z while drawing; 0 is infinitely far.
    cv::Mat depth = raster.depth_mm.rowRange(rows.first, rows.end);
    depth.setTo(0);
    raster.face.rowRange(rows.first, rows.end).setTo(-1);
    ForTrianglesOfBand(screen, band, [&](const ScreenTriangle& t) {
      DrawDepth(t, RowsInBand(t, rows), raster.depth_mm, raster.face);
    });
    for (int row = 0; row < depth.rows; ++row) {
      float* values = depth.ptr<float>(row);
      for (int x = 0; x < depth.cols; ++x) values[x] = 1.0f / values[x];
    }
  });
  return raster;
}

cv::Mat RasteriseMask(const TriangleMesh& mesh, const CameraFromModel& camera_from_model,
                      const Intrinsics& intrinsics) {
  return RasteriseCoverage(mesh, camera_from_model, intrinsics, 1);
}

cv::Mat RasteriseCoverage(const TriangleMesh& mesh, const CameraFromModel& camera_from_model,
                          const Intrinsics& intrinsics, int samples) {
  assert(samples >= 1 && samples <= 15);
  const ScreenTriangles screen = render::ProjectTriangles(mesh, camera_from_model, intrinsics);
  const int n = samples * samples;
  const std::vector<std::int64_t> x_offsets = LatticeOffsets(n);
  cv::Mat coverage(intrinsics.h, intrinsics.w, CV_8U);
  tbb::parallel_for(0, screen.bands, [&](int band) {
    const Rows rows{band * kBandRows, std::min(intrinsics.h, (band + 1) * kBandRows)};
    const bool empty =
        std::none_of(screen.chunks.begin(), screen.chunks.end(), [&](const auto& chunk) {
          const auto b = static_cast<std::size_t>(band);
          return chunk.band_first[b + 1] > chunk.band_first[b];
        });
    if (empty) {
      coverage.rowRange(rows.first, rows.end).setTo(0);
      return;
    }
    cv::Mat hits = cv::Mat::zeros((rows.end - rows.first) * n, intrinsics.w, CV_8U);
    ForTrianglesOfBand(screen, band, [&](const ScreenTriangle& t) {
      DrawSamples(t, RowsInBand(t, rows), rows.first, x_offsets, hits);
    });
    std::vector<std::uint8_t> counts(static_cast<std::size_t>(intrinsics.w));
    for (int row = rows.first; row < rows.end; ++row) {
      std::fill(counts.begin(), counts.end(), std::uint8_t{0});
      for (int j = 0; j < n; ++j) {
        const std::uint8_t* line = hits.ptr<std::uint8_t>((row - rows.first) * n + j);
        for (std::size_t x = 0; x < counts.size(); ++x) {
          counts[x] = static_cast<std::uint8_t>(counts[x] + line[x]);
        }
      }
      std::uint8_t* out = coverage.ptr<std::uint8_t>(row);
      for (std::size_t x = 0; x < counts.size(); ++x) {
        out[x] = static_cast<std::uint8_t>((2 * 255 * counts[x] + n) / (2 * n));
      }
    }
  });
  return coverage;
}

}  // namespace scan
