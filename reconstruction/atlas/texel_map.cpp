#include "reconstruction/atlas/texel_map.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "reconstruction/atlas/cross.h"

namespace scan {
namespace {

using Eigen::Vector2d;

struct Triangle {
  Vector2d p[3];  // in texels
};

Triangle TriangleOf(const AtlasMesh& atlas, std::size_t face, int size_px) {
  Triangle t;
  for (int k = 0; k < 3; ++k) t.p[k] = atlas.uv[atlas.mesh.faces[face][k]] * size_px;
  return t;
}

// Weights of the corners 1 and 2, and how far the triangle is from the point.
struct Nearest {
  Vector2d weights = Vector2d::Zero();
  double distance2 = 0;
};

Nearest NearestOnTriangle(const Triangle& t, const Vector2d& q) {
  const Vector2d e1 = t.p[1] - t.p[0], e2 = t.p[2] - t.p[0], r = q - t.p[0];
  const double det = Cross(e1, e2);
  if (det != 0) {
    const Vector2d w(Cross(r, e2) / det, Cross(e1, r) / det);
    if (w.x() >= 0 && w.y() >= 0 && w.x() + w.y() <= 1) return {w, 0};
  }
  Nearest best{Vector2d::Zero(), std::numeric_limits<double>::infinity()};
  const Vector2d corner_weights[3] = {{0, 0}, {1, 0}, {0, 1}};
  for (int k = 0; k < 3; ++k) {
    const Vector2d edge = t.p[(k + 1) % 3] - t.p[k];
    const double length2 = edge.squaredNorm();
    const double s = length2 > 0 ? std::clamp(edge.dot(q - t.p[k]) / length2, 0.0, 1.0) : 0.0;
    const double distance2 = (t.p[k] + s * edge - q).squaredNorm();
    if (distance2 < best.distance2)
      best = {(1 - s) * corner_weights[k] + s * corner_weights[(k + 1) % 3], distance2};
  }
  return best;
}

void Assign(TexelMap& map, int column, int row, std::int32_t face, const Vector2d& weights,
            TexelKind kind) {
  map.face.at<std::int32_t>(row, column) = face;
  map.barycentric.at<cv::Vec2f>(row, column) = {static_cast<float>(weights.x()),
                                                static_cast<float>(weights.y())};
  map.kind.at<std::uint8_t>(row, column) = static_cast<std::uint8_t>(kind);
}

struct Range {
  int first, last;  // inclusive
};

// Texels whose centre may lie between `low` and `high`.
Range CentresBetween(double low, double high, int size_px) {
  return {std::max(0, static_cast<int>(std::ceil(low - 0.5))),
          std::min(size_px - 1, static_cast<int>(std::floor(high - 0.5)))};
}

// Returns whether the face holds at least one texel.
bool FillFace(const Triangle& t, std::int32_t face, TexelMap& map) {
  const auto [x_low, x_high] = std::minmax({t.p[0].x(), t.p[1].x(), t.p[2].x()});
  const auto [y_low, y_high] = std::minmax({t.p[0].y(), t.p[1].y(), t.p[2].y()});
  const Range columns = CentresBetween(x_low, x_high, map.size_px);
  const Range rows = CentresBetween(y_low, y_high, map.size_px);
  bool any = false;
  for (int row = rows.first; row <= rows.last; ++row) {
    for (int column = columns.first; column <= columns.last; ++column) {
      const Nearest nearest = NearestOnTriangle(t, {column + 0.5, row + 0.5});
      if (nearest.distance2 > 0) continue;
      any = true;
      if (map.face.at<std::int32_t>(row, column) < 0)
        Assign(map, column, row, face, nearest.weights, TexelKind::inside);
    }
  }
  return any;
}

// A face between the texel centres still gets the texel that holds its middle, if that is free.
void ClaimOneTexel(const Triangle& t, std::int32_t face, TexelMap& map) {
  const Vector2d middle = (t.p[0] + t.p[1] + t.p[2]) / 3;
  const int column = std::clamp(static_cast<int>(middle.x()), 0, map.size_px - 1);
  const int row = std::clamp(static_cast<int>(middle.y()), 0, map.size_px - 1);
  if (map.face.at<std::int32_t>(row, column) >= 0) return;
  const Nearest nearest = NearestOnTriangle(t, {column + 0.5, row + 0.5});
  Assign(map, column, row, face, nearest.weights, TexelKind::inside);
}

struct GutterTexel {
  int column, row;
  std::int32_t face;
  Vector2d weights;
};

// One ring of texels around everything assigned so far.
std::vector<GutterTexel> NextRing(const AtlasMesh& atlas, const TexelMap& map) {
  std::vector<GutterTexel> ring;
  for (int row = 0; row < map.size_px; ++row) {
    for (int column = 0; column < map.size_px; ++column) {
      if (map.face.at<std::int32_t>(row, column) >= 0) continue;
      GutterTexel best{column, row, -1, Vector2d::Zero()};
      double best_distance2 = std::numeric_limits<double>::infinity();
      for (int y = std::max(0, row - 1); y <= std::min(map.size_px - 1, row + 1); ++y) {
        for (int x = std::max(0, column - 1); x <= std::min(map.size_px - 1, column + 1); ++x) {
          const std::int32_t face = map.face.at<std::int32_t>(y, x);
          if (face < 0 || face == best.face) continue;
          const Nearest nearest =
              NearestOnTriangle(TriangleOf(atlas, static_cast<std::size_t>(face), map.size_px),
                                {column + 0.5, row + 0.5});
          if (nearest.distance2 < best_distance2 ||
              (nearest.distance2 == best_distance2 && face < best.face)) {
            best_distance2 = nearest.distance2;
            best.face = face;
            best.weights = nearest.weights;
          }
        }
      }
      if (best.face >= 0) ring.push_back(best);
    }
  }
  return ring;
}

// One side of an edge of the unsplit surface.
struct SeamSide {
  std::uint32_t low, high;  // source vertices
  std::uint32_t face;
  int at_low, at_high;  // corners of the face
};

std::vector<SeamSide> SortedSides(const AtlasMesh& atlas) {
  std::vector<SeamSide> sides;
  sides.reserve(3 * atlas.mesh.faces.size());
  for (std::uint32_t f = 0; f < atlas.mesh.faces.size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      int from = k, to = (k + 1) % 3;
      std::uint32_t a = atlas.source_vertex[atlas.mesh.faces[f][from]];
      std::uint32_t b = atlas.source_vertex[atlas.mesh.faces[f][to]];
      if (a == b) continue;
      if (a > b) {
        std::swap(a, b);
        std::swap(from, to);
      }
      sides.push_back({a, b, f, from, to});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const SeamSide& x, const SeamSide& y) {
    if (x.low != y.low) return x.low < y.low;
    if (x.high != y.high) return x.high < y.high;
    return x.face < y.face;
  });
  return sides;
}

bool JoinedInAtlas(const AtlasMesh& atlas, const SeamSide& a, const SeamSide& b) {
  const Face &fa = atlas.mesh.faces[a.face], &fb = atlas.mesh.faces[b.face];
  return fa[a.at_low] == fb[b.at_low] && fa[a.at_high] == fb[b.at_high];
}

// The texel of a side at the share `s` of its edge: the first one inside the same chart on the way
// from the edge to the far corner; -1 when there is none within three texels.
std::int32_t TexelBeside(const AtlasMesh& atlas, const TexelMap& map, const SeamSide& side,
                         double s) {
  const Triangle t = TriangleOf(atlas, side.face, map.size_px);
  const Vector2d on_edge = (1 - s) * t.p[side.at_low] + s * t.p[side.at_high];
  const Vector2d edge = t.p[side.at_high] - t.p[side.at_low];
  Vector2d inward(-edge.y(), edge.x());
  if (inward.dot(t.p[3 - side.at_low - side.at_high] - on_edge) < 0) inward = -inward;
  if (inward.norm() > 0) inward.normalize();
  for (double depth = 0; depth <= 3; depth += 0.25) {
    const Vector2d p = on_edge + depth * inward;
    const int column = static_cast<int>(std::floor(p.x())),
              row = static_cast<int>(std::floor(p.y()));
    if (column < 0 || row < 0 || column >= map.size_px || row >= map.size_px) continue;
    if (map.kind.at<std::uint8_t>(row, column) != static_cast<std::uint8_t>(TexelKind::inside))
      continue;
    const std::int32_t face = map.face.at<std::int32_t>(row, column);
    if (atlas.chart[static_cast<std::size_t>(face)] == atlas.chart[side.face])
      return row * map.size_px + column;
  }
  return -1;
}

void LinkSides(const AtlasMesh& atlas, const SeamSide& a, const SeamSide& b, TexelMap& map) {
  double length = 0;  // in texels, of the longer side
  for (const SeamSide& side : {a, b}) {
    const Triangle t = TriangleOf(atlas, side.face, map.size_px);
    length = std::max(length, (t.p[side.at_high] - t.p[side.at_low]).norm());
  }
  const int samples = std::max(1, static_cast<int>(std::ceil(2 * length)));
  for (int i = 0; i < samples; ++i) {
    const double s = (i + 0.5) / samples;
    const std::int32_t x = TexelBeside(atlas, map, a, s), y = TexelBeside(atlas, map, b, s);
    if (x < 0 || y < 0 || x == y) continue;
    const SeamLink link{std::min(x, y), std::max(x, y)};
    const int columns = std::abs(link.a % map.size_px - link.b % map.size_px);
    const int rows = link.b / map.size_px - link.a / map.size_px;
    if (columns + rows > 1) map.seam_links.push_back(link);
  }
}

void FindSeamLinks(const AtlasMesh& atlas, TexelMap& map) {
  const std::vector<SeamSide> sides = SortedSides(atlas);
  for (std::size_t first = 0; first < sides.size();) {
    std::size_t last = first + 1;
    while (last < sides.size() && sides[last].low == sides[first].low &&
           sides[last].high == sides[first].high)
      ++last;
    for (std::size_t i = first; i + 1 < last; ++i)
      if (!JoinedInAtlas(atlas, sides[i], sides[i + 1]))
        LinkSides(atlas, sides[i], sides[i + 1], map);
    first = last;
  }
  std::sort(map.seam_links.begin(), map.seam_links.end());
  map.seam_links.erase(std::unique(map.seam_links.begin(), map.seam_links.end()),
                       map.seam_links.end());
}

}  // namespace

TexelMap MakeTexelMap(const AtlasMesh& atlas, int size_px, int gutter_px) {
  assert(size_px >= 1 && size_px <= 32768 && gutter_px >= 0);
  TexelMap map;
  map.size_px = size_px;
  map.face = cv::Mat(size_px, size_px, CV_32S, cv::Scalar(-1));
  map.barycentric = cv::Mat(size_px, size_px, CV_32FC2, cv::Scalar(0, 0));
  map.kind = cv::Mat(size_px, size_px, CV_8U, cv::Scalar(0));

  std::vector<std::int32_t> without_texel;
  for (std::size_t f = 0; f < atlas.mesh.faces.size(); ++f) {
    const auto face = static_cast<std::int32_t>(f);
    if (!FillFace(TriangleOf(atlas, f, size_px), face, map)) without_texel.push_back(face);
  }
  for (const std::int32_t face : without_texel)
    ClaimOneTexel(TriangleOf(atlas, static_cast<std::size_t>(face), size_px), face, map);
  for (int ring = 0; ring < gutter_px; ++ring)
    for (const GutterTexel& texel : NextRing(atlas, map))
      Assign(map, texel.column, texel.row, texel.face, texel.weights, TexelKind::gutter);
  FindSeamLinks(atlas, map);
  return map;
}

Eigen::Vector3d SurfacePoint(const AtlasMesh& atlas, const TexelMap& map, int column, int row) {
  const std::int32_t face = map.face.at<std::int32_t>(row, column);
  assert(face >= 0);
  const cv::Vec2f w = map.barycentric.at<cv::Vec2f>(row, column);
  const Face& corners = atlas.mesh.faces[static_cast<std::size_t>(face)];
  return (1.0 - w[0] - w[1]) * atlas.mesh.vertices[corners[0]] +
         static_cast<double>(w[0]) * atlas.mesh.vertices[corners[1]] +
         static_cast<double>(w[1]) * atlas.mesh.vertices[corners[2]];
}

}  // namespace scan
