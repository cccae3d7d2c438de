#include "reconstruction/pose/surface_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <queue>
#include <utility>

namespace scan {

SurfaceCells CellsOf(const ContourMesh& mesh, double size_mm) {
  SurfaceCells cells;
  cells.size_mm = std::max(1e-6, size_mm);
  std::map<std::array<int, 3>, int> index;
  std::vector<int> count;
  for (const Eigen::Vector3d& v : mesh.mesh.vertices) {
    std::array<int, 3> key{};
    for (int k = 0; k < 3; ++k)
      key[static_cast<std::size_t>(k)] =
          static_cast<int>(std::floor((v[k] - mesh.centre[k]) / cells.size_mm));
    const auto [place, added] = index.try_emplace(key, static_cast<int>(index.size()));
    if (added) {
      cells.centre.emplace_back(Eigen::Vector3d::Zero());
      count.push_back(0);
    }
    const auto cell = static_cast<std::size_t>(place->second);
    cells.centre[cell] += v;
    ++count[cell];
    cells.of_vertex.push_back(place->second);
  }
  for (std::size_t c = 0; c < count.size(); ++c) cells.centre[c] /= count[c];
  cells.beside.resize(count.size());
  for (const Face& face : mesh.mesh.faces) {
    for (int k = 0; k < 3; ++k) {
      const int a = cells.of_vertex[face[k]], b = cells.of_vertex[face[(k + 1) % 3]];
      if (a == b) continue;
      cells.beside[static_cast<std::size_t>(a)].push_back(b);
      cells.beside[static_cast<std::size_t>(b)].push_back(a);
    }
  }
  for (auto& beside : cells.beside) {
    std::sort(beside.begin(), beside.end());
    beside.erase(std::unique(beside.begin(), beside.end()), beside.end());
  }
  return cells;
}

std::vector<double> DistancesFrom(const SurfaceCells& cells, const std::vector<int>& sources) {
  std::vector<double> distance(cells.centre.size(), std::numeric_limits<double>::infinity());
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> next;
  for (const int s : sources) {
    distance[static_cast<std::size_t>(s)] = 0;
    next.emplace(0, s);
  }
  while (!next.empty()) {
    const auto [d, cell] = next.top();
    next.pop();
    if (d > distance[static_cast<std::size_t>(cell)]) continue;
    for (const int b : cells.beside[static_cast<std::size_t>(cell)]) {
      const double way = d + (cells.centre[static_cast<std::size_t>(b)] -
                              cells.centre[static_cast<std::size_t>(cell)])
                                 .norm();
      if (way >= distance[static_cast<std::size_t>(b)]) continue;
      distance[static_cast<std::size_t>(b)] = way;
      next.emplace(way, b);
    }
  }
  return distance;
}

namespace {

// Of each connected piece the cell nearest to `centre`.
std::vector<int> MiddlesOf(const SurfaceCells& cells, const Eigen::Vector3d& centre) {
  const int size = static_cast<int>(cells.centre.size());
  const auto from_centre = [&](int c) {
    return (cells.centre[static_cast<std::size_t>(c)] - centre).squaredNorm();
  };
  std::vector<int> middles;
  std::vector<bool> seen(cells.centre.size(), false);
  for (int first = 0; first < size; ++first) {
    if (seen[static_cast<std::size_t>(first)]) continue;
    int middle = first;
    std::vector<int> piece{first};
    seen[static_cast<std::size_t>(first)] = true;
    for (std::size_t n = 0; n < piece.size(); ++n) {
      if (from_centre(piece[n]) < from_centre(middle)) middle = piece[n];
      for (const int b : cells.beside[static_cast<std::size_t>(piece[n])]) {
        if (seen[static_cast<std::size_t>(b)]) continue;
        seen[static_cast<std::size_t>(b)] = true;
        piece.push_back(b);
      }
    }
    middles.push_back(middle);
  }
  return middles;
}

}  // namespace

std::vector<int> TipsOf(const SurfaceCells& cells, const Eigen::Vector3d& centre, double reach_mm) {
  const std::vector<double> outward = DistancesFrom(cells, MiddlesOf(cells, centre));
  std::vector<int> order(cells.centre.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return outward[static_cast<std::size_t>(a)] > outward[static_cast<std::size_t>(b)];
  });
  std::vector<int> tips;
  for (const int c : order) {
    const auto& beside = cells.beside[static_cast<std::size_t>(c)];
    const bool local = std::all_of(beside.begin(), beside.end(), [&](int b) {
      return outward[static_cast<std::size_t>(b)] <= outward[static_cast<std::size_t>(c)];
    });
    const bool apart = std::all_of(tips.begin(), tips.end(), [&](int t) {
      return (cells.centre[static_cast<std::size_t>(t)] - cells.centre[static_cast<std::size_t>(c)])
                 .norm() > reach_mm;
    });
    if (local && apart) tips.push_back(c);
  }
  return tips;
}

}  // namespace scan
