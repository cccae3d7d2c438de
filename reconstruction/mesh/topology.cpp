#include <algorithm>
#include <numeric>

#include "reconstruction/mesh/mesh.h"

namespace scan {
namespace {

// One side of an edge: the face it belongs to and which of its three edges it is.
struct HalfEdge {
  std::uint32_t low, high;  // vertices, low < high
  std::uint32_t face;
  std::uint8_t edge;  // joins corner `edge` and `edge` + 1
  bool forward;       // runs from low to high
};

// Sorted by vertices, then face; edges of a vertex with itself are left out.
std::vector<HalfEdge> SortedHalfEdges(const TriangleMesh& mesh) {
  std::vector<HalfEdge> edges;
  edges.reserve(mesh.faces.size() * 3);
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    for (std::uint8_t k = 0; k < 3; ++k) {
      const std::uint32_t from = mesh.faces[f][k], to = mesh.faces[f][(k + 1) % 3];
      if (from == to) continue;
      edges.push_back({std::min(from, to), std::max(from, to), f, k, from < to});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    if (a.low != b.low) return a.low < b.low;
    if (a.high != b.high) return a.high < b.high;
    if (a.face != b.face) return a.face < b.face;
    return a.edge < b.edge;
  });
  return edges;
}

// Calls visit(first, last) for each run of half-edges between the same two vertices.
template <class Visit>
void ForEachEdge(const std::vector<HalfEdge>& edges, Visit visit) {
  for (std::size_t first = 0; first < edges.size();) {
    std::size_t last = first + 1;
    while (last < edges.size() && edges[last].low == edges[first].low &&
           edges[last].high == edges[first].high)
      ++last;
    visit(first, last);
    first = last;
  }
}

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  std::uint32_t Find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void Join(std::uint32_t a, std::uint32_t b) {
    a = Find(a);
    b = Find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

std::uint32_t CornerAt(const TriangleMesh& mesh, const HalfEdge& edge, std::uint32_t vertex) {
  const std::uint32_t k = edge.edge;
  return 3 * edge.face + (mesh.faces[edge.face][k] == vertex ? k : (k + 1) % 3);
}

// Vertices whose corners do not all hang together through shared edges.
std::size_t CountSplitVertices(const TriangleMesh& mesh, const std::vector<HalfEdge>& edges) {
  DisjointSets fans(mesh.faces.size() * 3);
  ForEachEdge(edges, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first + 1; i < last; ++i) {
      for (const std::uint32_t v : {edges[first].low, edges[first].high})
        fans.Join(CornerAt(mesh, edges[first], v), CornerAt(mesh, edges[i], v));
    }
  });
  constexpr std::uint32_t kNone = ~0u;
  std::vector<std::uint32_t> fan_of(mesh.vertices.size(), kNone);
  std::vector<char> split(mesh.vertices.size(), 0);
  for (std::uint32_t corner = 0; corner < mesh.faces.size() * 3; ++corner) {
    const Face& face = mesh.faces[corner / 3];
    if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) continue;
    const std::uint32_t v = face[corner % 3], fan = fans.Find(corner);
    if (fan_of[v] == kNone) fan_of[v] = fan;
    if (fan_of[v] != fan) split[v] = 1;
  }
  return static_cast<std::size_t>(std::count(split.begin(), split.end(), 1));
}

}  // namespace

TopologyReport CheckTopology(const TriangleMesh& mesh) {
  TopologyReport report;
  const std::vector<HalfEdge> edges = SortedHalfEdges(mesh);
  std::size_t distinct_edges = 0;
  ForEachEdge(edges, [&](std::size_t first, std::size_t last) {
    ++distinct_edges;
    if (last - first == 1) ++report.boundary_edges;
    if (last - first > 2) ++report.non_manifold_edges;
    if (last - first == 2 && edges[first].forward == edges[first + 1].forward)
      ++report.inconsistent_edges;
  });
  report.non_manifold_vertices = CountSplitVertices(mesh, edges);

  DisjointSets joined(mesh.vertices.size());
  std::vector<char> used(mesh.vertices.size(), 0);
  for (const Face& face : mesh.faces) {
    for (const std::uint32_t v : face) used[v] = 1;
    joined.Join(face[0], face[1]);
    joined.Join(face[0], face[2]);
  }
  std::size_t used_vertices = 0;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!used[v]) continue;
    ++used_vertices;
    if (joined.Find(v) == v) ++report.components;
  }
  report.euler = static_cast<std::ptrdiff_t>(used_vertices) -
                 static_cast<std::ptrdiff_t>(distinct_edges) +
                 static_cast<std::ptrdiff_t>(mesh.faces.size());
  return report;
}

std::vector<std::array<std::int32_t, 3>> FaceNeighbours(const TriangleMesh& mesh) {
  std::vector<std::array<std::int32_t, 3>> neighbours(mesh.faces.size(), {-1, -1, -1});
  const std::vector<HalfEdge> edges = SortedHalfEdges(mesh);
  ForEachEdge(edges, [&](std::size_t first, std::size_t last) {
    if (last - first != 2 || edges[first].face == edges[first + 1].face) return;
    const HalfEdge &a = edges[first], &b = edges[first + 1];
    neighbours[a.face][a.edge] = static_cast<std::int32_t>(b.face);
    neighbours[b.face][b.edge] = static_cast<std::int32_t>(a.face);
  });
  return neighbours;
}

}  // namespace scan
