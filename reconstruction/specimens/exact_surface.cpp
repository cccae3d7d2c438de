// Marching cubes on a sparse grid. The cases are derived from one rule (on a face with two inside
// and two outside corners, the outside corners are kept apart), so that cells always agree.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <vector>

#include "reconstruction/specimens/specimen.h"

namespace scan {
namespace {

using Eigen::Vector3d;

constexpr int kBlock = 8;  // cells along a block
constexpr int kPart = 2;   // cells along the parts of a block that are skipped at once
constexpr int kNodes = kBlock + 1;

// Corner c of a cell lies at (c & 1, c >> 1 & 1, c >> 2). Edge 4 axis + k.
struct CubeEdge {
  int from, to, axis;
};

struct CubeTable {
  std::array<CubeEdge, 12> edges;
  std::array<std::uint8_t, 12> faces_of_edge;            // bits
  std::array<std::vector<std::vector<int>>, 256> loops;  // of edges; bit set = corner inside
};

int EdgeBetween(const CubeTable& table, int a, int b) {
  for (int e = 0; e < 12; ++e) {
    const CubeEdge& edge = table.edges[static_cast<std::size_t>(e)];
    if ((edge.from == a && edge.to == b) || (edge.from == b && edge.to == a)) return e;
  }
  return -1;
}

CubeTable MakeCubeTable() {
  CubeTable table;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = 1 << ((axis + 1) % 3), v = 1 << ((axis + 2) % 3);
    const std::array<int, 4> starts{0, u, v, u | v};
    for (int k = 0; k < 4; ++k) {
      const int from = starts[static_cast<std::size_t>(k)];
      table.edges[static_cast<std::size_t>(4 * axis + k)] = {from, from | (1 << axis), axis};
    }
  }
  // Corners of each face, counter-clockwise seen from outside of the cell.
  std::array<std::array<int, 4>, 6> faces;
  for (int axis = 0; axis < 3; ++axis) {
    const int n = 1 << axis, u = 1 << ((axis + 1) % 3), v = 1 << ((axis + 2) % 3);
    faces[static_cast<std::size_t>(2 * axis)] = {0, v, u | v, u};
    faces[static_cast<std::size_t>(2 * axis + 1)] = {n, n | u, n | u | v, n | v};
  }
  table.faces_of_edge.fill(0);
  for (std::size_t f = 0; f < 6; ++f) {
    for (std::size_t k = 0; k < 4; ++k) {
      const int e = EdgeBetween(table, faces[f][k], faces[f][(k + 1) % 4]);
      table.faces_of_edge[static_cast<std::size_t>(e)] |= static_cast<std::uint8_t>(1u << f);
    }
  }
  for (int cell = 1; cell < 255; ++cell) {
    const auto inside = [&](int corner) { return (cell >> corner & 1) != 0; };
    std::array<int, 12> next;
    next.fill(-1);
    for (const auto& face : faces) {
      for (std::size_t k = 0; k < 4; ++k) {
        if (!inside(face[k]) || inside(face[(k + 1) % 4])) continue;
        // Leaves the inside here; the segment ends where the walk enters it again.
        std::size_t m = (k + 1) % 4;
        while (!inside(face[(m + 1) % 4])) m = (m + 1) % 4;
        const int start = EdgeBetween(table, face[k], face[(k + 1) % 4]);
        const int end = EdgeBetween(table, face[m], face[(m + 1) % 4]);
        next[static_cast<std::size_t>(end)] = start;
      }
    }
    std::array<bool, 12> used{};
    for (int e = 0; e < 12; ++e) {
      std::vector<int> loop;
      for (int at = e;
           next[static_cast<std::size_t>(at)] >= 0 && !used[static_cast<std::size_t>(at)];
           at = next[static_cast<std::size_t>(at)]) {
        used[static_cast<std::size_t>(at)] = true;
        loop.push_back(at);
      }
      if (!loop.empty()) table.loops[static_cast<std::size_t>(cell)].push_back(std::move(loop));
    }
  }
  return table;
}

// A start from which a fan has no diagonal within a face of the cell (where the neighbouring cell
// might put the same one), or -1.
int FanStart(const CubeTable& table, const std::vector<int>& loop) {
  const std::size_t n = loop.size();
  for (std::size_t start = 0; start < n; ++start) {
    bool good = true;
    for (std::size_t k = 2; k + 1 < n; ++k) {
      const auto a = static_cast<std::size_t>(loop[start]);
      const auto b = static_cast<std::size_t>(loop[(start + k) % n]);
      good &= (table.faces_of_edge[a] & table.faces_of_edge[b]) == 0;
    }
    if (good) return static_cast<int>(start);
  }
  return -1;
}

struct Grid {
  Vector3d origin;
  double cell_mm;
  std::array<int, 3> blocks;
};

struct BlockMesh {
  std::vector<Vector3d> vertices;
  std::vector<std::int64_t> keys;  // of vertices that other blocks share, else -1
  std::vector<Face> faces;
};

class BlockMesher {
 public:
  BlockMesher(const Specimen& specimen, const CubeTable& table, const Grid& grid,
              std::array<int, 3> block)
      : specimen_(specimen), table_(table), grid_(grid) {
    for (std::size_t a = 0; a < 3; ++a) first_[a] = block[a] * kBlock;
  }

  BlockMesh Run() {
    const double half = 0.5 * kBlock * grid_.cell_mm;
    const Vector3d low = Node(0, 0, 0);
    if (std::abs(specimen_.SignedDistance(low + Vector3d::Constant(half))) >
        std::sqrt(3.0) * half + 1e-9) {
      return {};
    }
    values_.assign(kNodes * kNodes * kNodes, std::numeric_limits<double>::quiet_NaN());
    ids_.assign(3 * kNodes * kNodes * kNodes, -1);
    const double part = 0.5 * kPart * grid_.cell_mm;
    for (int z = 0; z < kBlock; z += kPart) {
      for (int y = 0; y < kBlock; y += kPart) {
        for (int x = 0; x < kBlock; x += kPart) {
          const Vector3d centre = Node(x, y, z) + Vector3d::Constant(part);
          const double d = specimen_.SignedDistance(centre);
          if (std::abs(d) <= std::sqrt(3.0) * part + 1e-9) MeshPart(x, y, z);
        }
      }
    }
    return std::move(mesh_);
  }

 private:
  Vector3d Node(int x, int y, int z) const {
    return grid_.origin + grid_.cell_mm * Vector3d(first_[0] + x, first_[1] + y, first_[2] + z);
  }
  static std::size_t Index(int x, int y, int z) {
    return static_cast<std::size_t>(x + kNodes * (y + kNodes * z));
  }

  double Value(int x, int y, int z) {
    double& value = values_[Index(x, y, z)];
    if (std::isnan(value)) value = specimen_.SignedDistance(Node(x, y, z));
    return value;
  }

  void MeshPart(int x0, int y0, int z0) {
    for (int z = z0; z < z0 + kPart; ++z) {
      for (int y = y0; y < y0 + kPart; ++y) {
        for (int x = x0; x < x0 + kPart; ++x) MeshCell(x, y, z);
      }
    }
  }

  void MeshCell(int x, int y, int z) {
    unsigned inside = 0;
    for (int c = 0; c < 8; ++c) {
      if (Value(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)) < 0) inside |= 1u << c;
    }
    for (const std::vector<int>& loop : table_.loops[inside]) {
      std::vector<std::uint32_t> corners;
      for (int e : loop) corners.push_back(VertexOf(x, y, z, e));
      const auto n = static_cast<std::uint32_t>(corners.size());
      if (const int start = FanStart(table_, loop); start >= 0) {
        const auto s = static_cast<std::uint32_t>(start);
        for (std::uint32_t k = 1; k + 1 < n; ++k) {
          mesh_.faces.push_back({corners[s], corners[(s + k) % n], corners[(s + k + 1) % n]});
        }
      } else {
        Vector3d centre = Vector3d::Zero();
        for (std::uint32_t v : corners) centre += mesh_.vertices[v] / n;
        const auto hub = static_cast<std::uint32_t>(mesh_.vertices.size());
        mesh_.vertices.push_back(OntoSurface(centre));
        mesh_.keys.push_back(-1);
        for (std::uint32_t k = 0; k < n; ++k) {
          mesh_.faces.push_back({hub, corners[k], corners[(k + 1) % n]});
        }
      }
    }
  }

  std::uint32_t VertexOf(int x, int y, int z, int e) {
    const CubeEdge& edge = table_.edges[static_cast<std::size_t>(e)];
    const int ax = x + (edge.from & 1), ay = y + (edge.from >> 1 & 1), az = z + (edge.from >> 2);
    const int bx = x + (edge.to & 1), by = y + (edge.to >> 1 & 1), bz = z + (edge.to >> 2);
    std::int32_t& id = ids_[3 * Index(ax, ay, az) + static_cast<std::size_t>(edge.axis)];
    if (id >= 0) return static_cast<std::uint32_t>(id);
    id = static_cast<std::int32_t>(mesh_.vertices.size());
    mesh_.vertices.push_back(
        Root(Node(ax, ay, az), Node(bx, by, bz), Value(ax, ay, az), Value(bx, by, bz)));
    const std::array<int, 3> a{ax, ay, az};
    bool shared = false;
    for (int k = 0; k < 3; ++k) {
      const int at = a[static_cast<std::size_t>(k)];
      shared |= k != edge.axis && (at == 0 || at == kBlock);
    }
    const std::int64_t nx = grid_.blocks[0] * kBlock + 1, ny = grid_.blocks[1] * kBlock + 1;
    const std::int64_t node = (first_[0] + ax) + nx * ((first_[1] + ay) + ny * (first_[2] + az));
    mesh_.keys.push_back(shared ? 3 * node + edge.axis : -1);
    return static_cast<std::uint32_t>(id);
  }

  // Illinois' regula falsi; the root stays off the ends so that no two vertices fall together.
  Vector3d Root(const Vector3d& a, const Vector3d& b, double fa, double fb) const {
    double ta = 0, tb = 1, t = 0.5;
    int kept = 0;  // the end that stayed in the last step
    for (int iteration = 0; iteration < 40; ++iteration) {
      t = ta + (tb - ta) * fa / (fa - fb);
      const double f = specimen_.SignedDistance(a + t * (b - a));
      if (std::abs(f) < 2e-6) break;
      if ((f < 0) == (fb < 0)) {
        tb = t;
        fb = f;
        if (kept == 1) fa *= 0.5;
        kept = 1;
      } else {
        ta = t;
        fa = f;
        if (kept == 2) fb *= 0.5;
        kept = 2;
      }
    }
    return a + std::clamp(t, 1e-4, 1 - 1e-4) * (b - a);
  }

  Vector3d OntoSurface(Vector3d p) const {
    constexpr double kStep = 1e-4;
    for (int iteration = 0; iteration < 8; ++iteration) {
      const double f = specimen_.SignedDistance(p);
      if (std::abs(f) < 2e-6) break;
      Vector3d gradient;
      for (int a = 0; a < 3; ++a) {
        const Vector3d d = kStep * Vector3d::Unit(a);
        gradient[a] =
            (specimen_.SignedDistance(p + d) - specimen_.SignedDistance(p - d)) / (2 * kStep);
      }
      if (gradient.squaredNorm() < 1e-4) break;
      p -= f * gradient / gradient.squaredNorm();
    }
    return p;
  }

  const Specimen& specimen_;
  const CubeTable& table_;
  const Grid& grid_;
  std::array<int, 3> first_;
  std::vector<double> values_;
  std::vector<std::int32_t> ids_;
  BlockMesh mesh_;
};

}  // namespace

TriangleMesh ExactSurface(const Specimen& specimen, double edge_mm) {
  assert(edge_mm > 0);
  const BoundingBox bounds = specimen.Bounds();
  Grid grid;
  grid.cell_mm = 1.3 * edge_mm;  // the mean edge of a marching-cubes mesh is about 0.77 cells
  const Vector3d margin = Vector3d::Constant(grid.cell_mm);
  grid.origin = bounds.low - margin;
  for (int a = 0; a < 3; ++a) {
    const double cells = (bounds.high + margin - grid.origin)[a] / grid.cell_mm;
    grid.blocks[static_cast<std::size_t>(a)] = static_cast<int>(std::ceil(cells / kBlock));
  }
  const CubeTable table = MakeCubeTable();
  const auto [nx, ny, nz] = grid.blocks;
  std::vector<BlockMesh> blocks(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) *
                                static_cast<std::size_t>(nz));
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    const int index = static_cast<int>(b);
    blocks[b] =
        BlockMesher(specimen, table, grid, {index % nx, index / nx % ny, index / nx / ny}).Run();
  });

  TriangleMesh mesh;
  std::unordered_map<std::int64_t, std::uint32_t> shared;
  for (const BlockMesh& block : blocks) {
    std::vector<std::uint32_t> ids(block.vertices.size());
    for (std::size_t v = 0; v < ids.size(); ++v) {
      ids[v] = static_cast<std::uint32_t>(mesh.vertices.size());
      if (block.keys[v] >= 0) {
        const auto [at, is_new] = shared.try_emplace(block.keys[v], ids[v]);
        if (!is_new) {
          ids[v] = at->second;
          continue;
        }
      }
      mesh.vertices.push_back(block.vertices[v]);
    }
    for (const Face& f : block.faces) mesh.faces.push_back({ids[f[0]], ids[f[1]], ids[f[2]]});
  }
  return mesh;
}

}  // namespace scan
