#include "reconstruction/surface/clean.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace scan {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

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

// A half-edge is 3 * face + k: from corner k to corner k + 1.
std::uint32_t Next(std::uint32_t half) { return half % 3 == 2 ? half - 2 : half + 1; }
std::uint32_t Vertex(const TriangleMesh& mesh, std::uint32_t half) {
  return mesh.faces[half / 3][half % 3];
}

void RemoveFlagged(TriangleMesh& mesh, const std::vector<std::uint8_t>& remove) {
  std::size_t kept = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    if (!remove[f]) mesh.faces[kept++] = mesh.faces[f];
  mesh.faces.resize(kept);
}

std::size_t RemoveDegenerate(TriangleMesh& mesh) {
  return std::erase_if(mesh.faces,
                       [](const Face& f) { return f[0] == f[1] || f[1] == f[2] || f[2] == f[0]; });
}

// Pairs of faces with the same corners and opposite orientation: a sheet without thickness.
std::size_t CancelBackToBack(TriangleMesh& mesh) {
  struct Key {
    Face sorted;
    std::uint32_t face;
    bool odd;
  };
  std::vector<Key> keys;
  keys.reserve(mesh.faces.size());
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    Face s = mesh.faces[f];
    bool odd = false;
    const auto order = [&](int a, int b) {
      if (s[a] > s[b]) std::swap(s[a], s[b]), odd = !odd;
    };
    order(0, 1), order(1, 2), order(0, 1);
    keys.push_back({s, f, odd});
  }
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    return a.sorted != b.sorted ? a.sorted < b.sorted : a.face < b.face;
  });
  std::vector<std::uint8_t> remove(mesh.faces.size(), 0);
  std::size_t removed = 0;
  for (std::size_t first = 0; first < keys.size();) {
    std::size_t last = first;
    std::vector<std::uint32_t> side[2];
    for (; last < keys.size() && keys[last].sorted == keys[first].sorted; ++last)
      side[keys[last].odd].push_back(keys[last].face);
    const std::size_t pairs = std::min(side[0].size(), side[1].size());
    for (std::size_t p = 0; p < pairs; ++p) remove[side[0][p]] = remove[side[1][p]] = 1;
    removed += 2 * pairs;
    first = last;
  }
  if (removed) RemoveFlagged(mesh, remove);
  return removed;
}

// Of several faces about one edge, the partner of a forward one is the first backward one met when
// turning from it into the material: each wedge of material keeps its own two faces.
void PairAboutEdge(const TriangleMesh& mesh, const std::vector<std::uint32_t>& forward,
                   std::vector<std::uint32_t> backward, std::vector<std::uint32_t>& partner) {
  const Eigen::Vector3d& low = mesh.vertices[Vertex(mesh, forward.front())];
  const Eigen::Vector3d& high = mesh.vertices[Vertex(mesh, Next(forward.front()))];
  Eigen::Vector3d axis = high - low;
  if (axis.norm() > 0) axis.normalize();
  const Eigen::Vector3d x = axis.unitOrthogonal(), y = axis.cross(x);
  const auto angle = [&](std::uint32_t half) {
    const Eigen::Vector3d to = mesh.vertices[Vertex(mesh, Next(Next(half)))] - low;
    return std::atan2(to.dot(y), to.dot(x));
  };
  for (const std::uint32_t f : forward) {
    if (backward.empty()) return;
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t b = 0; b < backward.size(); ++b) {
      double turn = angle(f) - angle(backward[b]);
      if (turn <= 0) turn += 2 * std::numbers::pi;
      if (turn < least) least = turn, best = b;
    }
    partner[f] = backward[best];
    partner[backward[best]] = f;
    backward.erase(backward.begin() + static_cast<std::ptrdiff_t>(best));
  }
}

struct Pairing {
  std::vector<std::uint32_t> partner;               // half-edge -> half-edge, kNone at a boundary
  std::vector<std::vector<std::uint32_t>> crowded;  // forward half-edges of edges with > 2 faces
};

Pairing PairHalfEdges(const TriangleMesh& mesh) {
  struct Key {
    std::uint32_t low, high, half;
  };
  std::vector<Key> keys;
  keys.reserve(mesh.faces.size() * 3);
  for (std::uint32_t h = 0; h < mesh.faces.size() * 3; ++h) {
    const std::uint32_t a = Vertex(mesh, h), b = Vertex(mesh, Next(h));
    keys.push_back({std::min(a, b), std::max(a, b), h});
  }
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    if (a.low != b.low) return a.low < b.low;
    if (a.high != b.high) return a.high < b.high;
    return a.half < b.half;
  });
  Pairing out;
  out.partner.assign(keys.size(), kNone);
  for (std::size_t first = 0; first < keys.size();) {
    std::size_t last = first;
    std::vector<std::uint32_t> forward, backward;
    const bool simple = first + 2 <= keys.size() && keys[first + 1].low == keys[first].low &&
                        keys[first + 1].high == keys[first].high &&
                        (first + 2 == keys.size() || keys[first + 2].low != keys[first].low ||
                         keys[first + 2].high != keys[first].high);
    if (simple) {
      const std::uint32_t a = keys[first].half, b = keys[first + 1].half;
      if (Vertex(mesh, a) != Vertex(mesh, b)) out.partner[a] = b, out.partner[b] = a;
      first += 2;
      continue;
    }
    for (; last < keys.size() && keys[last].low == keys[first].low &&
           keys[last].high == keys[first].high;
         ++last)
      (Vertex(mesh, keys[last].half) == keys[last].low ? forward : backward)
          .push_back(keys[last].half);
    if (!forward.empty() && !backward.empty()) {
      PairAboutEdge(mesh, forward, backward, out.partner);
      if (forward.size() > 1) out.crowded.push_back(std::move(forward));
    }
    first = last;
  }
  return out;
}

// Each fan of faces about a vertex gets a vertex of its own.
std::size_t SplitFans(TriangleMesh& mesh, const Pairing& pairing) {
  DisjointSets fans(mesh.faces.size() * 3);
  for (std::uint32_t h = 0; h < pairing.partner.size(); ++h) {
    const std::uint32_t p = pairing.partner[h];
    if (p == kNone || p < h) continue;
    fans.Join(h, Next(p));  // both at the start of h
    fans.Join(Next(h), p);
  }
  std::vector<std::uint32_t> fan_of(mesh.vertices.size(), kNone);
  std::vector<std::uint32_t> vertex_of(mesh.faces.size() * 3, kNone);
  std::size_t split = 0;
  for (std::uint32_t c = 0; c < mesh.faces.size() * 3; ++c) {
    const std::uint32_t root = fans.Find(c);
    std::uint32_t& corner = mesh.faces[c / 3][c % 3];
    if (vertex_of[root] == kNone) {
      if (fan_of[corner] == kNone) {
        fan_of[corner] = root;
        vertex_of[root] = corner;
      } else {
        vertex_of[root] = static_cast<std::uint32_t>(mesh.vertices.size());
        mesh.vertices.push_back(Eigen::Vector3d(mesh.vertices[corner]));
        ++split;
      }
    }
    corner = vertex_of[root];
  }
  return split;
}

// Pairs of faces that still share both ends of an edge get a midpoint each. One edge a face and
// call; returns how many were split.
std::size_t SplitCrowdedEdges(TriangleMesh& mesh, const Pairing& pairing) {
  std::vector<std::uint8_t> touched(mesh.faces.size(), 0);
  std::size_t split = 0;
  for (const auto& forward : pairing.crowded)
    for (const std::uint32_t h : forward) {
      const std::uint32_t p = pairing.partner[h];
      if (p == kNone || touched[h / 3] || touched[p / 3]) continue;
      touched[h / 3] = touched[p / 3] = 1;
      const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
      mesh.vertices.push_back(
          0.5 * (mesh.vertices[Vertex(mesh, h)] + mesh.vertices[Vertex(mesh, Next(h))]));
      for (const std::uint32_t side : {h, p}) {
        Face second = mesh.faces[side / 3];
        second[side % 3] = middle;
        mesh.faces[side / 3][Next(side) % 3] = middle;
        mesh.faces.push_back(second);
      }
      ++split;
    }
  return split;
}

void DropUnreferenced(TriangleMesh& mesh) {
  std::vector<std::uint32_t> target(mesh.vertices.size(), kNone);
  for (const Face& f : mesh.faces)
    for (const std::uint32_t v : f) target[v] = 0;
  std::uint32_t kept = 0;
  for (std::size_t v = 0; v < target.size(); ++v)
    if (target[v] != kNone) {
      mesh.vertices[kept] = mesh.vertices[v];
      target[v] = kept++;
    }
  mesh.vertices.resize(kept);
  for (Face& f : mesh.faces)
    for (std::uint32_t& v : f) v = target[v];
}

}  // namespace

CleanReport MakeManifold(TriangleMesh& mesh) {
  CleanReport report;
  report.degenerate_faces = RemoveDegenerate(mesh);
  report.cancelled_faces = CancelBackToBack(mesh);
  for (;;) {
    report.split_vertices += SplitFans(mesh, PairHalfEdges(mesh));
    const std::size_t split = SplitCrowdedEdges(mesh, PairHalfEdges(mesh));
    report.split_edges += split;
    if (split == 0) break;
  }
  DropUnreferenced(mesh);
  return report;
}

std::size_t DropSmallComponents(TriangleMesh& mesh, double least_share, bool drop_cavities) {
  DisjointSets sets(mesh.vertices.size());
  for (const Face& f : mesh.faces) {
    sets.Join(f[0], f[1]);
    sets.Join(f[0], f[2]);
  }
  std::vector<std::size_t> faces(mesh.vertices.size(), 0);
  std::vector<double> volume(mesh.vertices.size(), 0.0);
  std::size_t largest = 0;
  for (const Face& f : mesh.faces) {
    const std::uint32_t root = sets.Find(f[0]);
    largest = std::max(largest, ++faces[root]);
    const Eigen::Vector3d& o = mesh.vertices[root];
    volume[root] +=
        (mesh.vertices[f[0]] - o).dot((mesh.vertices[f[1]] - o).cross(mesh.vertices[f[2]] - o));
  }
  const auto dropped = [&](std::uint32_t root) {
    return (drop_cavities && volume[root] < 0) ||
           static_cast<double>(faces[root]) < least_share * static_cast<double>(largest);
  };
  std::size_t count = 0;
  for (std::uint32_t v = 0; v < faces.size(); ++v) count += faces[v] > 0 && dropped(v);
  if (count == 0) return 0;
  std::erase_if(mesh.faces, [&](const Face& f) { return dropped(sets.Find(f[0])); });
  DropUnreferenced(mesh);
  return count;
}

void Smooth(TriangleMesh& mesh, int iterations, double limit_mm) {
  const std::size_t count = mesh.vertices.size();
  std::vector<std::uint32_t> first(count + 1, 0), neighbour(mesh.faces.size() * 3);
  for (const Face& f : mesh.faces)
    for (const std::uint32_t v : f) ++first[v + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<std::uint32_t> fill(first.begin(), first.end() - 1);
  for (const Face& f : mesh.faces)
    for (int k = 0; k < 3; ++k) neighbour[fill[f[k]]++] = f[(k + 1) % 3];

  const std::vector<Eigen::Vector3d> original = mesh.vertices;
  std::vector<Eigen::Vector3d> moved(count);
  const auto step = [&](double weight) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count), [&](const auto& range) {
      for (std::size_t v = range.begin(); v < range.end(); ++v) {
        Eigen::Vector3d mean = Eigen::Vector3d::Zero();
        const std::size_t n = first[v + 1] - first[v];
        for (std::size_t e = first[v]; e < first[v + 1]; ++e) mean += mesh.vertices[neighbour[e]];
        const Eigen::Vector3d& here = mesh.vertices[v];
        moved[v] = n ? here + weight * (mean / static_cast<double>(n) - here) : here;
      }
    });
    mesh.vertices.swap(moved);
  };
  // Taubin's pair: pass band up to 0.1 of the mesh's highest frequency.
  constexpr double kShrink = 0.5, kGrow = -0.526;
  for (int n = 0; n < iterations; ++n) {
    step(kShrink);
    step(kGrow);
  }
  for (std::size_t v = 0; v < count; ++v) {
    const Eigen::Vector3d shift = mesh.vertices[v] - original[v];
    const double length = shift.norm();
    if (length > limit_mm) mesh.vertices[v] = original[v] + shift * (limit_mm / length);
  }
}

}  // namespace scan
