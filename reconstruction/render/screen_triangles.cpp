#include "reconstruction/render/screen_triangles.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace scan::render {
namespace {

constexpr std::size_t kChunkFaces = 4096;

enum class Place : std::uint8_t { inside, outside_guard, behind, folded };

struct ScreenVertex {
  double x = 0, y = 0;       // px
  double inverse_depth = 0;  // 1/mm
  Place place = Place::folded;
};

ScreenVertex ProjectVertex(const Intrinsics& intrinsics, const Eigen::Vector3d& in_camera) {
  ScreenVertex v;
  if (!(in_camera.z() >= kNear_mm)) {
    v.place = Place::behind;
    return v;
  }
  const auto pixel = Project(intrinsics, in_camera);
  if (!pixel || !pixel->allFinite()) return v;
  v.x = pixel->x();
  v.y = pixel->y();
  v.inverse_depth = 1 / in_camera.z();
  const bool guarded = std::abs(v.x) <= kGuardBand_px && std::abs(v.y) <= kGuardBand_px;
  v.place = guarded ? Place::inside : Place::outside_guard;
  return v;
}

std::int32_t Snap(double px) {
  return static_cast<std::int32_t>(std::lrint(px * static_cast<double>(kSubPixel)));
}

void EmitTriangle(const ScreenVertex& a, const ScreenVertex& b, const ScreenVertex& c, int w, int h,
                  std::int32_t face, std::vector<ScreenTriangle>& out) {
  const double low_x = std::min({a.x, b.x, c.x}), high_x = std::max({a.x, b.x, c.x});
  const double low_y = std::min({a.y, b.y, c.y}), high_y = std::max({a.y, b.y, c.y});
  if (high_x < 0 || low_x > w || high_y < 0 || low_y > h) return;
  ScreenTriangle t;
  t.x = {Snap(a.x), Snap(b.x), Snap(c.x)};
  t.y = {Snap(a.y), Snap(b.y), Snap(c.y)};
  std::array<double, 3> q{a.inverse_depth, b.inverse_depth, c.inverse_depth};
  std::int64_t x1 = t.x[1] - t.x[0], y1 = t.y[1] - t.y[0];
  std::int64_t x2 = t.x[2] - t.x[0], y2 = t.y[2] - t.y[0];
  std::int64_t twice_area = x1 * y2 - y1 * x2;
  if (twice_area == 0) return;
  if (twice_area < 0) {
    std::swap(t.x[1], t.x[2]);
    std::swap(t.y[1], t.y[2]);
    std::swap(q[1], q[2]);
    std::swap(x1, x2);
    std::swap(y1, y2);
    twice_area = -twice_area;
  }
  const double scale = static_cast<double>(kSubPixel) / static_cast<double>(twice_area);
  const double q1 = q[1] - q[0], q2 = q[2] - q[0];
  t.inverse_depth = q[0];
  t.dinverse_depth_dx = (q1 * static_cast<double>(y2) - q2 * static_cast<double>(y1)) * scale;
  t.dinverse_depth_dy = (q2 * static_cast<double>(x1) - q1 * static_cast<double>(x2)) * scale;
  t.inverse_depth_min = static_cast<float>(std::min({q[0], q[1], q[2]}));
  t.inverse_depth_max = static_cast<float>(std::max({q[0], q[1], q[2]}));
  t.face = face;
  out.push_back(t);
}

// Cuts a convex polygon; every new corner is computed from the inside corner towards the outside
// one, so that two faces get the same point on their common edge.
template <class Corner, class Inside, class Cross>
void ClipPolygon(std::vector<Corner>& polygon, Inside inside, Cross cross) {
  std::vector<Corner> out;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Corner& a = polygon[k];
    const Corner& b = polygon[(k + 1) % polygon.size()];
    const bool a_in = inside(a), b_in = inside(b);
    if (a_in) out.push_back(a);
    if (a_in != b_in) out.push_back(a_in ? cross(a, b) : cross(b, a));
  }
  polygon = std::move(out);
}

void ClipToGuard(std::vector<ScreenVertex>& polygon, double ScreenVertex::*axis, double sign) {
  ClipPolygon(
      polygon, [&](const ScreenVertex& v) { return sign * (v.*axis) <= kGuardBand_px; },
      [&](const ScreenVertex& in, const ScreenVertex& out) {
        const double t = (sign * kGuardBand_px - in.*axis) / (out.*axis - in.*axis);
        ScreenVertex v;
        v.x = in.x + t * (out.x - in.x);
        v.y = in.y + t * (out.y - in.y);
        v.inverse_depth = in.inverse_depth + t * (out.inverse_depth - in.inverse_depth);
        v.*axis = sign * kGuardBand_px;
        v.place = Place::inside;
        return v;
      });
}

void EmitClipped(const Intrinsics& intrinsics, const std::array<Eigen::Vector3d, 3>& in_camera,
                 std::int32_t face, std::vector<ScreenTriangle>& out) {
  std::vector<Eigen::Vector3d> corners(in_camera.begin(), in_camera.end());
  ClipPolygon(
      corners, [](const Eigen::Vector3d& p) { return p.z() >= kNear_mm; },
      [](const Eigen::Vector3d& in, const Eigen::Vector3d& outside) {
        const double t = (kNear_mm - in.z()) / (outside.z() - in.z());
        Eigen::Vector3d p = in + t * (outside - in);
        p.z() = kNear_mm;
        return p;
      });
  std::vector<ScreenVertex> polygon;
  for (const Eigen::Vector3d& p : corners) {
    polygon.push_back(ProjectVertex(intrinsics, p));
    if (polygon.back().place == Place::folded) return;
  }
  ClipToGuard(polygon, &ScreenVertex::x, 1);
  ClipToGuard(polygon, &ScreenVertex::x, -1);
  ClipToGuard(polygon, &ScreenVertex::y, 1);
  ClipToGuard(polygon, &ScreenVertex::y, -1);
  for (std::size_t k = 2; k < polygon.size(); ++k) {
    EmitTriangle(polygon[0], polygon[k - 1], polygon[k], intrinsics.w, intrinsics.h, face, out);
  }
}

void SortIntoBands(TriangleChunk& chunk, int h, int bands) {
  const auto band_range = [&](const ScreenTriangle& t) {
    const auto [low, high] = std::minmax({t.y[0], t.y[1], t.y[2]});
    const int first = std::clamp<int>(low >> kSubPixelBits, 0, h - 1) / kBandRows;
    const int last = std::clamp<int>(high >> kSubPixelBits, 0, h - 1) / kBandRows;
    return std::pair(static_cast<std::size_t>(first), static_cast<std::size_t>(last));
  };
  chunk.band_first.assign(static_cast<std::size_t>(bands) + 1, 0);
  for (const ScreenTriangle& t : chunk.triangles) {
    const auto [first, last] = band_range(t);
    for (std::size_t band = first; band <= last; ++band) ++chunk.band_first[band + 1];
  }
  for (std::size_t band = 0; band < static_cast<std::size_t>(bands); ++band) {
    chunk.band_first[band + 1] += chunk.band_first[band];
  }
  chunk.order.resize(chunk.band_first.back());
  std::vector<std::uint32_t> next(chunk.band_first.begin(), chunk.band_first.end() - 1);
  for (std::size_t k = 0; k < chunk.triangles.size(); ++k) {
    const auto [first, last] = band_range(chunk.triangles[k]);
    for (std::size_t band = first; band <= last; ++band) {
      chunk.order[next[band]++] = static_cast<std::uint32_t>(k);
    }
  }
}

}  // namespace

ScreenTriangles ProjectTriangles(const TriangleMesh& mesh, const CameraFromModel& camera_from_model,
                                 const Intrinsics& intrinsics) {
  ScreenTriangles result;
  result.w = intrinsics.w;
  result.h = intrinsics.h;
  result.bands = (intrinsics.h + kBandRows - 1) / kBandRows;
  const Eigen::Matrix3d rotation = camera_from_model.rotation();
  const Eigen::Vector3d translation = camera_from_model.translation();
  const auto to_camera = [&](std::uint32_t vertex) -> Eigen::Vector3d {
    return rotation * mesh.vertices[vertex] + translation;
  };

  std::vector<ScreenVertex> screen(mesh.vertices.size());
  tbb::parallel_for(
      tbb::blocked_range<std::uint32_t>(0, static_cast<std::uint32_t>(mesh.vertices.size()), 4096),
      [&](const auto& range) {
        for (std::uint32_t v = range.begin(); v != range.end(); ++v) {
          screen[v] = ProjectVertex(intrinsics, to_camera(v));
        }
      });

  result.chunks.resize((mesh.faces.size() + kChunkFaces - 1) / kChunkFaces);
  tbb::parallel_for(std::size_t{0}, result.chunks.size(), [&](std::size_t c) {
    TriangleChunk& chunk = result.chunks[c];
    const std::size_t end = std::min(mesh.faces.size(), (c + 1) * kChunkFaces);
    chunk.triangles.reserve(kChunkFaces);
    for (std::size_t f = c * kChunkFaces; f < end; ++f) {
      const Face& face = mesh.faces[f];
      const ScreenVertex &p = screen[face[0]], &q = screen[face[1]], &r = screen[face[2]];
      const auto id = static_cast<std::int32_t>(f);
      if (p.place == Place::inside && q.place == Place::inside && r.place == Place::inside) {
        EmitTriangle(p, q, r, intrinsics.w, intrinsics.h, id, chunk.triangles);
      } else if (p.place != Place::folded && q.place != Place::folded && r.place != Place::folded) {
        EmitClipped(intrinsics, {to_camera(face[0]), to_camera(face[1]), to_camera(face[2])}, id,
                    chunk.triangles);
      }
    }
    SortIntoBands(chunk, result.h, result.bands);
  });
  return result;
}

}  // namespace scan::render
