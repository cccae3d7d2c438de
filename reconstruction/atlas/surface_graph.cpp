#include "reconstruction/atlas/surface_graph.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>

namespace scan {
namespace {

// The faces' normals of a CT surface carry its noise; charts should follow the shape under it.
constexpr int kSmoothingRounds = 4;

void MeasureFaces(const TriangleMesh& mesh, SurfaceGraph& graph) {
  const std::size_t count = mesh.faces.size();
  graph.degenerate.assign(count, 0);
  for (std::size_t f = 0; f < count; ++f) {
    const Eigen::Vector3d& a = mesh.vertices[mesh.faces[f][0]];
    const Eigen::Vector3d& b = mesh.vertices[mesh.faces[f][1]];
    const Eigen::Vector3d& c = mesh.vertices[mesh.faces[f][2]];
    const Eigen::Vector3d n = (b - a).cross(c - a);
    const double longest2 =
        std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    const double double_area = n.norm();
    // A height below a millionth of the longest side cannot be told from none in single precision.
    graph.degenerate[f] =
        !(double_area > 1e-6 * longest2) || !std::isfinite(double_area) || double_area < 1e-300;
    graph.area.push_back(graph.degenerate[f] ? 0 : 0.5 * double_area);
    graph.normal.push_back(graph.degenerate[f] ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                                               : Eigen::Vector3d(n / double_area));
    graph.centre.push_back((a + b + c) / 3);
  }
}

std::array<std::uint32_t, 2> EdgeOf(const Face& face, int k) {
  return {face[static_cast<std::size_t>(k)], face[static_cast<std::size_t>((k + 1) % 3)]};
}

struct Side {
  std::uint32_t low, high;  // vertices
  std::uint32_t face;
  std::int8_t edge;
  bool forward;
};

void Link(const Side& a, const Side& b, SurfaceGraph& graph) {
  graph.links[a.face][static_cast<std::size_t>(a.edge)] = {static_cast<std::int32_t>(b.face),
                                                           b.edge};
  graph.links[b.face][static_cast<std::size_t>(b.edge)] = {static_cast<std::int32_t>(a.face),
                                                           a.edge};
}

// Three or more faces at an edge: the flattest pairs that run against each other belong together
// (doubled sheets and shells that touch come apart so); the rest ends here.
void LinkFlattestPairs(std::vector<Side> sides, SurfaceGraph& graph) {
  for (;;) {
    std::size_t best_i = 0, best_j = 0;
    double flattest = -0.5;
    for (std::size_t i = 0; i < sides.size(); ++i)
      for (std::size_t j = i + 1; j < sides.size(); ++j) {
        if (sides[i].forward == sides[j].forward || sides[i].face == sides[j].face) continue;
        const double flat = graph.normal[sides[i].face].dot(graph.normal[sides[j].face]);
        if (flat <= flattest + 1e-9) continue;
        flattest = flat;
        best_i = i;
        best_j = j;
      }
    if (best_i == best_j) return;
    Link(sides[best_i], sides[best_j], graph);
    sides.erase(sides.begin() + static_cast<std::ptrdiff_t>(best_j));
    sides.erase(sides.begin() + static_cast<std::ptrdiff_t>(best_i));
  }
}

void LinkFaces(const TriangleMesh& mesh, SurfaceGraph& graph) {
  graph.links.resize(mesh.faces.size());
  std::vector<Side> sides;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    if (graph.degenerate[f]) continue;
    for (int k = 0; k < 3; ++k) {
      const auto [from, to] = EdgeOf(mesh.faces[f], k);
      sides.push_back(
          {std::min(from, to), std::max(from, to), f, static_cast<std::int8_t>(k), from < to});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.face, a.edge) < std::tie(b.low, b.high, b.face, b.edge);
  });
  for (auto first = sides.begin(); first != sides.end();) {
    const auto last = std::find_if(first, sides.end(), [&](const Side& side) {
      return side.low != first->low || side.high != first->high;
    });
    if (last - first == 2) Link(*first, *(first + 1), graph);
    // More than a handful of sheets at one edge is no surface, and pairing them grows cubic.
    if (last - first > 2 && last - first <= 16) LinkFlattestPairs({first, last}, graph);
    first = last;
  }
}

// Turns faces so that neighbours agree; a link that closes a Moebius band is cut.
void Orient(const TriangleMesh& mesh, SurfaceGraph& graph) {
  const std::size_t count = mesh.faces.size();
  graph.flipped.assign(count, 0);
  std::vector<char> visited(count, 0);
  std::vector<std::size_t> queue;
  for (std::size_t seed = 0; seed < count; ++seed) {
    if (visited[seed]) continue;
    visited[seed] = 1;
    queue.assign(1, seed);
    for (std::size_t next = 0; next < queue.size(); ++next) {
      const std::size_t f = queue[next];
      for (int k = 0; k < 3; ++k) {
        FaceLink& link = graph.links[f][static_cast<std::size_t>(k)];
        if (link.face < 0) continue;
        const auto g = static_cast<std::size_t>(link.face);
        const bool opposed = EdgeOf(mesh.faces[f], k)[0] != EdgeOf(mesh.faces[g], link.edge)[0];
        const char wanted = opposed ? graph.flipped[f] : !graph.flipped[f];
        if (!visited[g]) {
          visited[g] = 1;
          graph.flipped[g] = wanted;
          queue.push_back(g);
        } else if (graph.flipped[g] != wanted) {
          graph.links[g][static_cast<std::size_t>(link.edge)] = {};
          link = {};
        }
      }
    }
  }
  for (std::size_t f = 0; f < count; ++f)
    if (graph.flipped[f]) graph.normal[f] = -graph.normal[f];
}

void SmoothNormals(SurfaceGraph& graph) {
  for (int round = 0; round < kSmoothingRounds; ++round) {
    const std::vector<Eigen::Vector3d> before = graph.normal;
    for (std::size_t f = 0; f < before.size(); ++f) {
      if (graph.degenerate[f]) continue;
      Eigen::Vector3d sum = graph.area[f] * before[f];
      for (const FaceLink& link : graph.links[f]) {
        if (link.face < 0) continue;
        const auto g = static_cast<std::size_t>(link.face);
        sum += graph.area[g] * before[g];
      }
      if (sum.norm() > 1e-3 * graph.area[f]) graph.normal[f] = sum.normalized();
    }
  }
}

}  // namespace

SurfaceGraph MakeSurfaceGraph(const TriangleMesh& mesh) {
  SurfaceGraph graph;
  MeasureFaces(mesh, graph);
  LinkFaces(mesh, graph);
  Orient(mesh, graph);
  SmoothNormals(graph);
  return graph;
}

}  // namespace scan
