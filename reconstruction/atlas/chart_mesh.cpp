#include "reconstruction/atlas/chart_mesh.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <numeric>
#include <queue>

namespace scan {
namespace {

constexpr std::uint32_t kNone = ~0u;

std::uint32_t LocalIndex(const std::vector<std::uint32_t>& ascending, std::int32_t face) {
  if (face < 0) return kNone;
  const auto f = static_cast<std::uint32_t>(face);
  const auto at = std::lower_bound(ascending.begin(), ascending.end(), f);
  if (at == ascending.end() || *at != f) return kNone;
  return static_cast<std::uint32_t>(at - ascending.begin());
}

// Corners joined across the inner edges of a set of faces: corner 3 i + k of its i-th face.
struct Corners {
  std::vector<std::uint32_t> parent;
  std::size_t inner_edges = 0;
  std::vector<std::array<std::uint32_t, 2>> border;  // local face, edge

  std::uint32_t Find(std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  }
  void Join(std::uint32_t a, std::uint32_t b) {
    a = Find(a);
    b = Find(b);
    parent[std::max(a, b)] = std::min(a, b);
  }
  std::size_t Vertices() const {
    std::size_t count = 0;
    for (std::uint32_t i = 0; i < parent.size(); ++i) count += parent[i] == i;
    return count;
  }
};

Corners JoinCorners(const TriangleMesh& mesh, const SurfaceGraph& graph,
                    const std::vector<std::uint32_t>& faces) {
  Corners corners;
  corners.parent.resize(3 * faces.size());
  std::iota(corners.parent.begin(), corners.parent.end(), 0u);
  for (std::uint32_t i = 0; i < faces.size(); ++i) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const FaceLink& link = graph.links[faces[i]][k];
      const std::uint32_t j = LocalIndex(faces, link.face);
      if (j == kNone) {
        corners.border.push_back({i, k});
        continue;
      }
      if (j < i) continue;
      ++corners.inner_edges;
      const auto e = static_cast<std::uint32_t>(link.edge);
      std::uint32_t first = 3 * j + e, second = 3 * j + (e + 1) % 3;
      if (mesh.faces[faces[j]][e] != mesh.faces[faces[i]][k]) std::swap(first, second);
      corners.Join(3 * i + k, first);
      corners.Join(3 * i + (k + 1) % 3, second);
    }
  }
  return corners;
}

// Euler characteristic 1 and a border: of the connected orientable surfaces only the disk.
bool DiskByEuler(const Corners& corners, std::size_t faces) {
  return !corners.border.empty() &&
         corners.Vertices() + faces == 3 * faces - corners.inner_edges + 1;
}

struct Reached {
  double distance;
  std::uint32_t face, seed;
  friend bool operator>(const Reached& a, const Reached& b) {
    if (a.distance != b.distance) return a.distance > b.distance;
    if (a.face != b.face) return a.face > b.face;
    return a.seed > b.seed;
  }
};

// Which seed reaches each face first; `last` receives the face reached last of all.
std::vector<std::uint32_t> Flood(const SurfaceGraph& graph, const std::vector<std::uint32_t>& faces,
                                 const std::vector<std::uint32_t>& seeds, std::uint32_t& last) {
  std::vector<std::uint32_t> owner(faces.size(), kNone);
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> queue;
  for (std::uint32_t s = 0; s < seeds.size(); ++s) queue.push({0, seeds[s], s});
  while (!queue.empty()) {
    const Reached at = queue.top();
    queue.pop();
    if (owner[at.face] != kNone) continue;
    owner[at.face] = at.seed;
    last = at.face;
    const std::uint32_t f = faces[at.face];
    for (const FaceLink& link : graph.links[f]) {
      const std::uint32_t next = LocalIndex(faces, link.face);
      if (next == kNone || owner[next] != kNone) continue;
      const std::uint32_t g = faces[next];
      // Folds are far: the cut between the two halves falls into them.
      const double bend = 1 - graph.normal[f].dot(graph.normal[g]);
      queue.push({at.distance + (graph.centre[f] - graph.centre[g]).norm() * (1 + 8 * bend), next,
                  at.seed});
    }
  }
  return owner;
}

}  // namespace

bool IsDisk(const TriangleMesh& mesh, const SurfaceGraph& graph,
            const std::vector<std::uint32_t>& ascending_faces) {
  return DiskByEuler(JoinCorners(mesh, graph, ascending_faces), ascending_faces.size());
}

ChartMesh MakeChartMesh(const TriangleMesh& mesh, const SurfaceGraph& graph,
                        std::vector<std::uint32_t> faces) {
  Corners corners = JoinCorners(mesh, graph, faces);
  ChartMesh chart;
  chart.disk = DiskByEuler(corners, faces.size());
  std::vector<std::uint32_t> vertex_of(corners.parent.size(), kNone);
  for (std::uint32_t i = 0; i < faces.size(); ++i) {
    Face local{};
    for (std::uint32_t k = 0; k < 3; ++k) {
      std::uint32_t& vertex = vertex_of[corners.Find(3 * i + k)];
      if (vertex == kNone) {
        vertex = static_cast<std::uint32_t>(chart.source_vertex.size());
        chart.source_vertex.push_back(mesh.faces[faces[i]][k]);
        chart.mesh.vertices.push_back(mesh.vertices[mesh.faces[faces[i]][k]]);
      }
      local[k] = vertex;
    }
    if (graph.flipped[faces[i]]) std::swap(local[1], local[2]);
    chart.mesh.faces.push_back(local);
  }
  for (const auto& [i, k] : corners.border) {
    std::array<std::uint32_t, 2> edge{vertex_of[corners.Find(3 * i + k)],
                                      vertex_of[corners.Find(3 * i + (k + 1) % 3)]};
    if (graph.flipped[faces[i]]) std::swap(edge[0], edge[1]);
    chart.border.push_back(edge);
  }
  chart.faces = std::move(faces);
  return chart;
}

std::array<std::vector<std::uint32_t>, 2> Bisect(
    const SurfaceGraph& graph, const std::vector<std::uint32_t>& ascending_faces) {
  assert(ascending_faces.size() >= 2);
  std::uint32_t a = 0, b = 0;
  Flood(graph, ascending_faces, {0}, a);
  Flood(graph, ascending_faces, {a}, b);
  if (a == b) b = a == 0 ? 1 : 0;
  std::uint32_t last = 0;
  const auto owner = Flood(graph, ascending_faces, {a, b}, last);
  std::array<std::vector<std::uint32_t>, 2> halves;
  for (std::size_t i = 0; i < owner.size(); ++i)
    halves[owner[i] == 1 ? 1 : 0].push_back(ascending_faces[i]);
  return halves;
}

}  // namespace scan
