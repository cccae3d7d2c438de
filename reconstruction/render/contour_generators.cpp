#include "reconstruction/render/contour_generators.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>

namespace scan {
namespace {

// Which side of the plane through the camera and the edge p lies on.
int SideOf(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& p) {
  const double side = a.cross(b).dot(p);
  return side > 0 ? 1 : (side < 0 ? -1 : 0);
}

int FindOutward(const TriangleMesh& mesh, const MeshEdges& edges) {
  for (const MeshEdge& edge : edges.edges) {
    if (edge.face_count != 2) return 0;
    if (RunsForward(mesh.faces[edges.faces[edge.first_face]], edge.vertices) ==
        RunsForward(mesh.faces[edges.faces[edge.first_face + 1]], edge.vertices)) {
      return 0;
    }
  }
  double volume = 0;
  for (const Face& f : mesh.faces) {
    volume += mesh.vertices[f[0]].dot(mesh.vertices[f[1]].cross(mesh.vertices[f[2]]));
  }
  return volume > 0 ? 1 : (volume < 0 ? -1 : 0);
}

// At a hollow fold of a solid the ray to the edge comes through the solid itself.
bool IsHollow(const TriangleMesh& mesh, const MeshEdges& edges, const MeshEdge& edge) {
  if (edges.outward == 0) return false;
  const Face& face = mesh.faces[edges.faces[edge.first_face]];
  const Face& other = mesh.faces[edges.faces[edge.first_face + 1]];
  const Eigen::Vector3d& a = mesh.vertices[face[0]];
  const Eigen::Vector3d normal =
      (mesh.vertices[face[1]] - a).cross(mesh.vertices[face[2]] - a) * edges.outward;
  return normal.dot(mesh.vertices[OppositeVertex(other, edge.vertices)] - a) > 0;
}

struct Surroundings {
  bool inside_picture = false;
  bool background = false;
  float farthest_mm = 0;
};

// The outside of an outline shows what lies behind it: the farthest of the 3 x 3 nearest pixels.
Surroundings LookAround(const Raster& raster, const Eigen::Vector2d& pixel) {
  Surroundings found;
  const int x = static_cast<int>(std::floor(pixel.x())),
            y = static_cast<int>(std::floor(pixel.y()));
  if (x < 0 || y < 0 || x >= raster.face.cols || y >= raster.face.rows) return found;
  found.inside_picture = true;
  for (int v = std::max(0, y - 1); v <= std::min(raster.face.rows - 1, y + 1); ++v) {
    for (int u = std::max(0, x - 1); u <= std::min(raster.face.cols - 1, x + 1); ++u) {
      found.farthest_mm = std::max(found.farthest_mm, raster.depth_mm.at<float>(v, u));
      found.background |= raster.face.at<std::int32_t>(v, u) < 0;
    }
  }
  return found;
}

}  // namespace

std::uint32_t OppositeVertex(const Face& face, const std::array<std::uint32_t, 2>& edge) {
  for (std::uint32_t v : face) {
    if (v != edge[0] && v != edge[1]) return v;
  }
  return edge[0];
}

bool RunsForward(const Face& face, const std::array<std::uint32_t, 2>& edge) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (face[k] == edge[0] && face[(k + 1) % 3] == edge[1]) return true;
  }
  return false;
}

MeshEdges BuildMeshEdges(const TriangleMesh& mesh) {
  struct Entry {
    std::uint32_t a, b, face;
    bool operator<(const Entry& o) const {
      return std::tie(a, b, face) < std::tie(o.a, o.b, o.face);
    }
  };
  std::vector<Entry> entries;
  entries.reserve(3 * mesh.faces.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const Face& face = mesh.faces[f];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(face[k], face[(k + 1) % 3]);
      if (low != high) entries.push_back({low, high, static_cast<std::uint32_t>(f)});
    }
  }
  std::sort(entries.begin(), entries.end());
  MeshEdges result;
  result.faces.reserve(entries.size());
  for (const Entry& e : entries) {
    const auto at = static_cast<std::uint32_t>(result.faces.size());
    if (result.edges.empty() || result.edges.back().vertices != std::array{e.a, e.b}) {
      result.edges.push_back({{e.a, e.b}, at, 0});
    }
    ++result.edges.back().face_count;
    result.faces.push_back(e.face);
  }
  result.outward = FindOutward(mesh, result);
  return result;
}

std::vector<ContourSegment> ContourGenerators(const TriangleMesh& mesh, const MeshEdges& edges,
                                              const CameraFromModel& camera_from_model,
                                              const Intrinsics& intrinsics, const Raster& raster,
                                              double depth_tolerance_mm) {
  const Eigen::Vector3d centre = CameraCentre(camera_from_model);
  constexpr std::size_t kChunkEdges = 16384;
  std::vector<std::vector<ContourSegment>> chunks((edges.edges.size() + kChunkEdges - 1) /
                                                  kChunkEdges);
  tbb::parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t c) {
    const std::size_t end = std::min(edges.edges.size(), (c + 1) * kChunkEdges);
    for (std::size_t e = c * kChunkEdges; e < end; ++e) {
      const MeshEdge& edge = edges.edges[e];
      const Eigen::Vector3d& va = mesh.vertices[edge.vertices[0]];
      const Eigen::Vector3d& vb = mesh.vertices[edge.vertices[1]];
      const Eigen::Vector3d a = va - centre, b = vb - centre;
      bool fold = true;
      int first_side = 0;
      for (std::uint32_t k = 0; k < edge.face_count && fold; ++k) {
        const Face& face = mesh.faces[edges.faces[edge.first_face + k]];
        const int side = SideOf(a, b, mesh.vertices[OppositeVertex(face, edge.vertices)] - centre);
        if (k == 0) first_side = side;
        fold = side == first_side;
      }
      if (!fold) continue;
      const Eigen::Vector3d ca = camera_from_model * va, cb = camera_from_model * vb;
      if (ca.z() <= 0 || cb.z() <= 0) continue;
      ContourSegment segment;
      segment.vertices = edge.vertices;
      segment.faces = {static_cast<std::int32_t>(edges.faces[edge.first_face]), -1};
      if (edge.face_count > 1) {
        segment.faces[1] = static_cast<std::int32_t>(edges.faces[edge.first_face + 1]);
      }
      const Eigen::Vector3d middle = 0.5 * (ca + cb);
      if (const auto pixel = Project(intrinsics, middle)) {
        const Surroundings around = LookAround(raster, *pixel);
        const bool hollow = edge.face_count == 2 && IsHollow(mesh, edges, edge);
        segment.visible = around.inside_picture && !hollow &&
                          around.farthest_mm >= middle.z() - depth_tolerance_mm;
        segment.outer = segment.visible && around.background;
      }
      chunks[c].push_back(segment);
    }
  });
  std::vector<ContourSegment> result;
  for (const auto& chunk : chunks) result.insert(result.end(), chunk.begin(), chunk.end());
  return result;
}

}  // namespace scan
