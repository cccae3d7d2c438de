#include "reconstruction/atlas/relax.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

namespace scan {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kLeastCotangent = 0.05;  // slivers and obtuse corners

// A face laid into the plane, and the cotangent of the angle across from edge k (corner k to k+1).
struct FlatFace {
  std::array<Vector2d, 3> at;
  std::array<double, 3> cotangent;
};

FlatFace Flatten(const TriangleMesh& mesh, const Face& f) {
  const Vector3d &a = mesh.vertices[f[0]], ab = mesh.vertices[f[1]] - a,
                 ac = mesh.vertices[f[2]] - a;
  const double length = ab.norm(), height = ab.cross(ac).norm() / length;
  FlatFace flat{{Vector2d(0, 0), Vector2d(length, 0), Vector2d(ab.dot(ac) / length, height)}, {}};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector2d p = flat.at[k] - flat.at[(k + 2) % 3],
                   q = flat.at[(k + 1) % 3] - flat.at[(k + 2) % 3];
    const double cross = p.x() * q.y() - p.y() * q.x();
    flat.cotangent[k] = std::max(kLeastCotangent, p.dot(q) / std::max(cross, 1e-300));
    flat.cotangent[k] = std::min(flat.cotangent[k], 1 / kLeastCotangent);
  }
  return flat;
}

// The rotation that turns the flat face best onto its present place.
Eigen::Matrix2d BestRotation(const FlatFace& flat, const Face& f, const std::vector<Vector2d>& uv) {
  double cosine = 0, sine = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector2d u = uv[f[(k + 1) % 3]] - uv[f[k]], x = flat.at[(k + 1) % 3] - flat.at[k];
    cosine += flat.cotangent[k] * x.dot(u);
    sine += flat.cotangent[k] * (x.x() * u.y() - x.y() * u.x());
  }
  const double length = std::hypot(cosine, sine);
  if (!(length > 0)) return Eigen::Matrix2d::Identity();
  Eigen::Matrix2d turn;
  turn << cosine, -sine, sine, cosine;
  return turn / length;
}

}  // namespace

bool Relax(ChartMesh& chart, int rounds) {
  const std::size_t count = chart.uv.size();
  std::vector<FlatFace> flat;
  std::vector<Eigen::Triplet<double>> entries{{0, 0, 1.0}};  // one vertex is held
  for (const Face& f : chart.mesh.faces) {
    flat.push_back(Flatten(chart.mesh, f));
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = static_cast<int>(f[k]), b = static_cast<int>(f[(k + 1) % 3]);
      const double w = flat.back().cotangent[k];
      entries.insert(entries.end(), {{a, a, w}, {b, b, w}, {a, b, -w}, {b, a, -w}});
    }
  }
  const auto n = static_cast<Eigen::Index>(count);
  Eigen::SparseMatrix<double> laplacian(n, n);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(laplacian);
  if (solver.info() != Eigen::Success) return false;
  std::vector<Vector2d> uv = chart.uv;
  for (int round = 0; round < rounds; ++round) {
    Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(n, 2);
    right.row(0) = uv[0];
    for (std::size_t i = 0; i < flat.size(); ++i) {
      const Face& f = chart.mesh.faces[i];
      const Eigen::Matrix2d turn = BestRotation(flat[i], f, uv);
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector2d edge =
            flat[i].cotangent[k] * (turn * (flat[i].at[(k + 1) % 3] - flat[i].at[k]));
        right.row(static_cast<Eigen::Index>(f[(k + 1) % 3])) += edge;
        right.row(static_cast<Eigen::Index>(f[k])) -= edge;
      }
    }
    const Eigen::MatrixX2d solved = solver.solve(right);
    if (!solved.allFinite()) return false;
    for (std::size_t v = 0; v < count; ++v) uv[v] = solved.row(static_cast<Eigen::Index>(v));
  }
  chart.uv = std::move(uv);
  return true;
}

}  // namespace scan
