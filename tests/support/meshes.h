// Meshes with known shape for tests; all closed ones are outward.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>

#include "drivers/base/units.h"
#include "reconstruction/mesh/mesh.h"

namespace scan::meshes {

// Each subdivision quadruples the 20 faces.
inline TriangleMesh Icosphere(double radius_mm, int subdivisions,
                              const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
  const double t = (1 + std::sqrt(5.0)) / 2;
  TriangleMesh mesh;
  mesh.vertices = {{-1, t, 0},  {1, t, 0},  {-1, -t, 0}, {1, -t, 0}, {0, -1, t},  {0, 1, t},
                   {0, -1, -t}, {0, 1, -t}, {t, 0, -1},  {t, 0, 1},  {-t, 0, -1}, {-t, 0, 1}};
  mesh.faces = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int level = 0; level < subdivisions; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, is_new] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.vertices.size()));
      if (is_new) mesh.vertices.push_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
      return at->second;
    };
    std::vector<Face> finer;
    for (const Face& f : mesh.faces) {
      const std::uint32_t a = middle(f[0], f[1]), b = middle(f[1], f[2]), c = middle(f[2], f[0]);
      finer.insert(finer.end(), {{f[0], a, c}, {f[1], b, a}, {f[2], c, b}, {a, b, c}});
    }
    mesh.faces = std::move(finer);
  }
  for (Eigen::Vector3d& v : mesh.vertices) v = centre + radius_mm * v.normalized();
  return mesh;
}

// Twelve faces, eight vertices.
inline TriangleMesh Box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.emplace_back(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(),
                               i & 4 ? high.z() : low.z());
  mesh.faces = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

// A grid of nu x nv quads over (u, v) in [0, 1]^2, closed up in u and v where asked.
inline TriangleMesh Grid(int nu, int nv, bool wrap_u, bool wrap_v,
                         const std::function<Eigen::Vector3d(double, double)>& point) {
  TriangleMesh mesh;
  const int rows = wrap_v ? nv : nv + 1, columns = wrap_u ? nu : nu + 1;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i)
      mesh.vertices.push_back(point(static_cast<double>(i) / nu, static_cast<double>(j) / nv));
  const auto id = [&](int i, int j) {
    return static_cast<std::uint32_t>((j % rows) * columns + i % columns);
  };
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      mesh.faces.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
      mesh.faces.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
    }
  return mesh;
}

// About the z axis.
inline TriangleMesh Torus(double ring_radius_mm, double tube_radius_mm, int nu, int nv) {
  return Grid(nu, nv, true, true, [=](double u, double v) {
    const double a = 2 * kPi * u, b = 2 * kPi * v;
    const double r = ring_radius_mm + tube_radius_mm * std::cos(b);
    return Eigen::Vector3d(r * std::cos(a), r * std::sin(a), tube_radius_mm * std::sin(b));
  });
}

// The side of a cylinder about the z axis from z = 0, open at both ends.
inline TriangleMesh OpenCylinder(double radius_mm, double height_mm, int nu, int nv) {
  return Grid(nu, nv, true, false, [=](double u, double v) {
    const double a = 2 * kPi * u;
    return Eigen::Vector3d(radius_mm * std::cos(a), radius_mm * std::sin(a), height_mm * v);
  });
}

// A closed cylinder about the z axis from z = 0.
inline TriangleMesh Cylinder(double radius_mm, double height_mm, int nu, int nv) {
  TriangleMesh mesh = OpenCylinder(radius_mm, height_mm, nu, nv);
  const auto low = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.emplace_back(0, 0, 0);
  mesh.vertices.emplace_back(0, 0, height_mm);
  for (int i = 0; i < nu; ++i) {
    const auto a = static_cast<std::uint32_t>(i), b = static_cast<std::uint32_t>((i + 1) % nu);
    const auto top = static_cast<std::uint32_t>(nu * nv);
    mesh.faces.push_back({low, b, a});
    mesh.faces.push_back({low + 1, top + a, top + b});
  }
  return mesh;
}

// The level set f = 0 inside a box by marching tetrahedra, outward from f < 0; open where it meets
// the box.
inline TriangleMesh LevelSet(const Eigen::Vector3d& low, const Eigen::Vector3d& high, int cells,
                             const std::function<double(const Eigen::Vector3d&)>& f) {
  const int n = cells + 1;
  const auto at = [&](int i) {
    const Eigen::Vector3d t(i % n, (i / n) % n, i / (n * n));
    return Eigen::Vector3d(low + (high - low).cwiseProduct(t) / cells);
  };
  std::vector<double> values;
  for (int i = 0; i < n * n * n; ++i) values.push_back(f(at(i)));
  TriangleMesh mesh;
  std::map<std::pair<int, int>, std::uint32_t> crossings;
  const auto cross = [&](int inside, int outside) {
    const auto [entry, is_new] =
        crossings.try_emplace({std::min(inside, outside), std::max(inside, outside)},
                              static_cast<std::uint32_t>(mesh.vertices.size()));
    if (is_new) {
      const double t = std::clamp(values[inside] / (values[inside] - values[outside]), 0.05, 0.95);
      mesh.vertices.push_back((1 - t) * at(inside) + t * at(outside));
    }
    return entry->second;
  };
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c,
                       const Eigen::Vector3d& outward) {
    const Eigen::Vector3d normal =
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    if (normal.dot(outward) < 0) std::swap(b, c);
    mesh.faces.push_back({a, b, c});
  };
  // Six tetrahedra about the diagonal of a cell: the orders in which the three axes are walked.
  constexpr int kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  const int step[3] = {1, n, n * n};
  for (int k = 0; k < cells; ++k)
    for (int j = 0; j < cells; ++j)
      for (int i = 0; i < cells; ++i)
        for (const auto& order : kOrders) {
          std::array<int, 4> corner{i + n * (j + n * k), 0, 0, 0};
          for (std::size_t c = 0; c < 3; ++c) corner[c + 1] = corner[c] + step[order[c]];
          std::vector<int> in, out;
          for (const int c : corner) (values[c] < 0 ? in : out).push_back(c);
          if (in.empty() || out.empty()) continue;
          Eigen::Vector3d outward = Eigen::Vector3d::Zero();
          for (const int c : out) outward += at(c) / static_cast<double>(out.size());
          for (const int c : in) outward -= at(c) / static_cast<double>(in.size());
          if (in.size() == 1) {
            add(cross(in[0], out[0]), cross(in[0], out[1]), cross(in[0], out[2]), outward);
          } else if (out.size() == 1) {
            add(cross(in[0], out[0]), cross(in[1], out[0]), cross(in[2], out[0]), outward);
          } else {
            const std::uint32_t q[4] = {cross(in[0], out[0]), cross(in[0], out[1]),
                                        cross(in[1], out[1]), cross(in[1], out[0])};
            add(q[0], q[1], q[2], outward);
            add(q[0], q[2], q[3], outward);
          }
        }
  return mesh;
}

// A closed surface of high genus: a gyroid shell cut by a ball.
inline TriangleMesh Gyroid(double radius_mm, double period_mm, int cells) {
  const Eigen::Vector3d corner = Eigen::Vector3d::Constant(1.1 * radius_mm);
  return LevelSet(-corner, corner, cells, [=](const Eigen::Vector3d& p) {
    const Eigen::Vector3d q = 2 * kPi / period_mm * p;
    const double gyroid = std::sin(q.x()) * std::cos(q.y()) + std::sin(q.y()) * std::cos(q.z()) +
                          std::sin(q.z()) * std::cos(q.x());
    return std::max(gyroid * period_mm / 9, p.norm() - radius_mm);
  });
}

inline TriangleMesh Joined(TriangleMesh a, const TriangleMesh& b) {
  const auto shift = static_cast<std::uint32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const Face& f : b.faces) a.faces.push_back({f[0] + shift, f[1] + shift, f[2] + shift});
  return a;
}

}  // namespace scan::meshes
