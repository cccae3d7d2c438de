#include "reconstruction/pose/contour_clusters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <tuple>

#include "drivers/base/units.h"

namespace scan {
namespace {

constexpr int kCells = 12;  // squared, on each side of a cube: directions within about 5 degrees
constexpr std::uint32_t kEdges = 64;
constexpr double kSpare_rad = 0.02;  // for rounding, and lines of sight that a lens bends
// Between an edge's two faces, rad: like with like keeps the cones narrow. Beyond the last an edge
// is always looked at.
constexpr std::array<double, 3> kSharpness{0.1, 0.25, 0.7};

struct Key {
  std::uint32_t sharpness = 0, direction = 0, place = 0, edge = 0;
  bool operator<(const Key& o) const {
    return std::tie(sharpness, direction, place, edge) <
           std::tie(o.sharpness, o.direction, o.place, o.edge);
  }
  bool together(const Key& o) const { return sharpness == o.sharpness && direction == o.direction; }
};

// Cell of a cube's surface that a direction passes through.
std::uint32_t DirectionCell(const Eigen::Vector3d& n) {
  Eigen::Index axis = 0;
  const double largest = n.cwiseAbs().maxCoeff(&axis);
  const auto cell = [&](Eigen::Index k) {
    const double t = 0.5 * (n[k] / largest + 1);
    return static_cast<std::uint32_t>(std::clamp(static_cast<int>(t * kCells), 0, kCells - 1));
  };
  const std::uint32_t side = static_cast<std::uint32_t>(2 * axis + (n[axis] < 0 ? 1 : 0));
  return (side * kCells + cell((axis + 1) % 3)) * kCells + cell((axis + 2) % 3);
}

// Near in space, near in number: the bits of a grid's three coordinates in turn.
std::uint32_t MortonCode(const Eigen::Vector3d& in_unit_cube) {
  std::uint32_t code = 0;
  for (int bit = 9; bit >= 0; --bit)
    for (int k = 0; k < 3; ++k) {
      const auto grid = static_cast<std::uint32_t>(std::clamp(in_unit_cube[k] * 1024, 0.0, 1023.0));
      code = code << 1 | (grid >> bit & 1);
    }
  return code;
}

Key KeyOf(const TriangleMesh& mesh, const MeshEdges& edges, std::uint32_t index,
          const std::vector<Eigen::Vector3d>& normals, const BoundingBox& box) {
  const MeshEdge& edge = edges.edges[index];
  Key key;
  key.edge = index;
  key.sharpness = kSharpness.size();
  const Eigen::Vector3d size = (box.high - box.low).cwiseMax(1e-9);
  key.place = MortonCode(
      (0.5 * (mesh.vertices[edge.vertices[0]] + mesh.vertices[edge.vertices[1]]) - box.low)
          .cwiseQuotient(size));
  if (edge.face_count != 2) return key;
  const std::uint32_t f = edges.faces[edge.first_face], g = edges.faces[edge.first_face + 1];
  if (RunsForward(mesh.faces[f], edge.vertices) == RunsForward(mesh.faces[g], edge.vertices))
    return key;
  const double cosine = normals[f].dot(normals[g]);  // 0 where one has no area
  std::uint32_t sharpness = 0;
  while (sharpness < kSharpness.size() && cosine < std::cos(kSharpness[sharpness])) ++sharpness;
  key.sharpness = sharpness;
  if (sharpness < kSharpness.size()) key.direction = DirectionCell(normals[f] + normals[g]);
  return key;
}

// Ball and cone of a cluster whose edges are keys [begin, end).
void Enclose(const TriangleMesh& mesh, const MeshEdges& edges, std::span<const Key> keys,
             const std::vector<Eigen::Vector3d>& normals, ContourCluster& cluster) {
  const auto for_each_face = [&](const auto& use) {
    for (const Key& key : keys)
      for (std::uint32_t k = 0; k < edges.edges[key.edge].face_count; ++k)
        use(edges.faces[edges.edges[key.edge].first_face + k]);
  };
  Eigen::Vector3d low = mesh.vertices[edges.edges[keys.front().edge].vertices[0]], high = low;
  for_each_face([&](std::uint32_t f) {
    cluster.axis += normals[f];
    for (const std::uint32_t v : mesh.faces[f]) {
      low = low.cwiseMin(mesh.vertices[v]);
      high = high.cwiseMax(mesh.vertices[v]);
    }
  });
  cluster.centre = 0.5 * (low + high);
  cluster.radius_mm = 0.5 * (high - low).norm();
  const double norm = cluster.axis.norm();
  if (!(norm > 1e-9)) return;
  cluster.axis /= norm;
  double cosine = 1;
  for_each_face([&](std::uint32_t f) { cosine = std::min(cosine, cluster.axis.dot(normals[f])); });
  const double angle = std::acos(std::clamp(cosine, -1.0, 1.0)) + kSpare_rad;
  if (angle >= kPi / 2) return;
  cluster.cone_sin = std::sin(angle);
  cluster.cone_cos = std::cos(angle);
}

std::vector<Key> SortedKeys(const TriangleMesh& mesh, const MeshEdges& edges,
                            const std::vector<Eigen::Vector3d>& normals) {
  std::vector<Key> keys;
  if (edges.edges.empty()) return keys;
  const BoundingBox box = BoundsOf(mesh);
  keys.reserve(edges.edges.size());
  for (std::uint32_t e = 0; e < edges.edges.size(); ++e)
    keys.push_back(KeyOf(mesh, edges, e, normals, box));
  std::sort(keys.begin(), keys.end());
  return keys;
}

}  // namespace

ContourClusters MakeContourClusters(const TriangleMesh& mesh, const MeshEdges& edges) {
  const std::vector<Eigen::Vector3d> normals = FaceNormals(mesh);
  const std::vector<Key> keys = SortedKeys(mesh, edges, normals);
  ContourClusters made;
  made.edges.reserve(keys.size());
  made.corners.reserve(2 * keys.size());
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> point_of(mesh.vertices.size(), kNone);
  const auto point = [&](std::uint32_t vertex) {
    if (point_of[vertex] == kNone) {
      point_of[vertex] = static_cast<std::uint32_t>(made.points.size());
      made.points.push_back(mesh.vertices[vertex]);
      made.mesh_vertices.push_back(vertex);
    }
    return point_of[vertex];
  };
  for (std::size_t begin = 0, end = 0; begin < keys.size(); begin = end) {
    while (end < keys.size() && end - begin < kEdges && keys[end].together(keys[begin])) ++end;
    const auto own = std::span(keys).subspan(begin, end - begin);
    ContourCluster& cluster = made.clusters.emplace_back();
    cluster.first_edge = static_cast<std::uint32_t>(begin);
    cluster.edge_count = static_cast<std::uint32_t>(own.size());
    if (own.front().sharpness < kSharpness.size()) Enclose(mesh, edges, own, normals, cluster);
    for (const Key& key : own) {
      const MeshEdge& edge = edges.edges[key.edge];
      made.edges.push_back({{point(edge.vertices[0]), point(edge.vertices[1])},
                            static_cast<std::uint32_t>(made.corners.size()),
                            edge.face_count});
      for (std::uint32_t k = 0; k < edge.face_count; ++k)
        made.corners.push_back(
            point(OppositeVertex(mesh.faces[edges.faces[edge.first_face + k]], edge.vertices)));
    }
  }
  return made;
}

bool TurnsOneSide(const ContourCluster& cluster, const CameraFromModel& camera_from_model,
                  const Intrinsics& intrinsics, const Eigen::Vector3d& camera_centre) {
  const Eigen::Vector3d sight = cluster.centre - camera_centre;
  const double distance = sight.norm();
  // A cone around the lines of sight, too.
  const double ball_sin = cluster.radius_mm / std::max(distance, 1e-9);
  if (ball_sin >= 1) return false;
  const double ball_cos = std::sqrt(1 - ball_sin * ball_sin);
  const double both_cos = cluster.cone_cos * ball_cos - cluster.cone_sin * ball_sin;
  const double both_sin = cluster.cone_sin * ball_cos + cluster.cone_cos * ball_sin;
  if (!(both_cos > 0) || std::abs(cluster.axis.dot(sight)) <= both_sin * distance) return false;
  // Far outside of the picture, or behind the camera, a lens's polynomial may do anything.
  const Eigen::Vector3d x = camera_from_model * cluster.centre;
  if (!(x.z() > cluster.radius_mm)) return false;
  return std::abs(x.x() / x.z()) * intrinsics.fl_x < intrinsics.w &&
         std::abs(x.y() / x.z()) * intrinsics.fl_y < intrinsics.h;
}

}  // namespace scan
