#include "reconstruction/atlas/chart_growth.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <queue>

#include "reconstruction/atlas/chart_mesh.h"

namespace scan {
namespace {

// Normals of a developable piece lie on a circle of the Gauss sphere: the smallest eigenvalue of
// their covariance says how far from it. 0.012 is a cap of about 52 degrees half angle.
constexpr double kMaxUndevelopable = 0.012;
// 1 - |mean normal|^2: half a cylinder has 0.59, a cap of 60 degrees half angle 0.44.
constexpr double kMaxSpread = 0.72;
// Crumbs join a neighbour at nearly any price; whether that unfolds is checked afterwards.
constexpr double kMaxUndevelopableOfCrumb = 0.05;
constexpr double kMaxSpreadOfCrumb = 0.8;
constexpr double kCrumbShare = 3e-4;  // of the surface
// How much being far apart counts beside being bent.
constexpr double kCompactness = 0.15;
constexpr double kReferenceCharts = 60;

struct Cluster {
  std::vector<std::uint32_t> faces;
  double area = 0;
  Eigen::Vector3d normals = Eigen::Vector3d::Zero();  // area-weighted sums
  Eigen::Matrix3d normal_moment = Eigen::Matrix3d::Zero();
  Eigen::Vector3d centres = Eigen::Vector3d::Zero();
  std::map<std::uint32_t, double> shared_mm;  // length of the border with each neighbour
  double border_mm = 0;
  std::uint32_t version = 0;
  bool alive = false;
};

struct Candidate {
  double cost;
  std::uint32_t a, b, version_a, version_b;
  friend bool operator>(const Candidate& x, const Candidate& y) {
    if (x.cost != y.cost) return x.cost > y.cost;
    if (x.a != y.a) return x.a > y.a;
    return x.b > y.b;
  }
};

class Growth {
 public:
  Growth(const TriangleMesh& mesh, const SurfaceGraph& graph) : mesh_(mesh), graph_(graph) {
    total_area_ = std::accumulate(graph.area.begin(), graph.area.end(), 0.0);
    clusters_.resize(mesh.faces.size());
    for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
      if (!graph.degenerate[f]) Start(f);
    for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) Propose(f, true);
  }

  Status Run(const ProgressFn& progress, const std::stop_token& stop) {
    const std::size_t start = std::max<std::size_t>(1, clusters_.size());
    std::size_t merges = 0;
    for (std::size_t step = 0; !queue_.empty(); ++step) {
      if (step % 1024 == 0) {
        if (stop.stop_requested()) return Cancelled("atlas charts");
        Report(progress, "charts", static_cast<double>(merges) / static_cast<double>(start));
      }
      const Candidate next = queue_.top();
      queue_.pop();
      const Cluster &a = clusters_[next.a], &b = clusters_[next.b];
      if (!a.alive || !b.alive || a.version != next.version_a || b.version != next.version_b)
        continue;
      if (!Allowed(a, b)) continue;
      Merge(next.a, next.b);
      ++merges;
    }
    return {};
  }

  std::vector<std::vector<std::uint32_t>> Release() {
    std::vector<std::vector<std::uint32_t>> charts;
    for (Cluster& cluster : clusters_)
      if (cluster.alive) charts.push_back(std::move(cluster.faces));
    std::sort(charts.begin(), charts.end());
    return charts;
  }

 private:
  void Start(std::uint32_t f) {
    Cluster& cluster = clusters_[f];
    cluster.alive = true;
    cluster.faces = {f};
    cluster.area = graph_.area[f];
    cluster.normals = graph_.area[f] * graph_.normal[f];
    cluster.normal_moment = graph_.area[f] * graph_.normal[f] * graph_.normal[f].transpose();
    cluster.centres = graph_.area[f] * graph_.centre[f];
    for (std::size_t k = 0; k < 3; ++k) {
      const double length =
          (mesh_.vertices[mesh_.faces[f][k]] - mesh_.vertices[mesh_.faces[f][(k + 1) % 3]]).norm();
      cluster.border_mm += length;
      const std::int32_t neighbour = graph_.links[f][k].face;
      if (neighbour >= 0) cluster.shared_mm[static_cast<std::uint32_t>(neighbour)] += length;
    }
  }

  // Ward's criterion: what the sum of squared deviations grows by, in normals and in places; less
  // for pairs that share much of their borders.
  double Cost(const Cluster& a, const Cluster& b, double shared_mm) const {
    const double mass = a.area * b.area / (a.area + b.area);
    const double bent = (a.normals / a.area - b.normals / b.area).squaredNorm();
    const double apart =
        (a.centres / a.area - b.centres / b.area).squaredNorm() * kReferenceCharts / total_area_;
    const double border = a.border_mm + b.border_mm - 2 * shared_mm;
    const double shape = border * border / (4 * 3.14159265358979 * (a.area + b.area));
    return mass * (bent + kCompactness * apart) * std::sqrt(std::max(1.0, shape));
  }

  void Propose(std::uint32_t a, bool only_higher) {
    if (!clusters_[a].alive) return;
    for (const auto& [b, shared_mm] : clusters_[a].shared_mm) {
      if (only_higher && b < a) continue;
      queue_.push({Cost(clusters_[a], clusters_[b], shared_mm), std::min(a, b), std::max(a, b),
                   clusters_[std::min(a, b)].version, clusters_[std::max(a, b)].version});
    }
  }

  bool Allowed(const Cluster& a, const Cluster& b) const {
    const double area = a.area + b.area;
    const bool crumb = std::min(a.area, b.area) < kCrumbShare * total_area_;
    const Eigen::Vector3d mean = (a.normals + b.normals) / area;
    if (1 - mean.squaredNorm() > (crumb ? kMaxSpreadOfCrumb : kMaxSpread)) return false;
    const Eigen::Matrix3d covariance =
        (a.normal_moment + b.normal_moment) / area - mean * mean.transpose();
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(covariance, Eigen::EigenvaluesOnly);
    if (solver.eigenvalues()[0] > (crumb ? kMaxUndevelopableOfCrumb : kMaxUndevelopable))
      return false;
    std::vector<std::uint32_t> faces;
    std::merge(a.faces.begin(), a.faces.end(), b.faces.begin(), b.faces.end(),
               std::back_inserter(faces));
    return IsDisk(mesh_, graph_, faces);
  }

  void Merge(std::uint32_t into, std::uint32_t from) {
    Cluster &a = clusters_[into], &b = clusters_[from];
    std::vector<std::uint32_t> faces;
    std::merge(a.faces.begin(), a.faces.end(), b.faces.begin(), b.faces.end(),
               std::back_inserter(faces));
    a.faces = std::move(faces);
    a.area += b.area;
    a.normals += b.normals;
    a.normal_moment += b.normal_moment;
    a.centres += b.centres;
    a.border_mm += b.border_mm - 2 * a.shared_mm[from];
    a.shared_mm.erase(from);
    b.shared_mm.erase(into);
    for (const auto& [neighbour, length] : b.shared_mm) {
      a.shared_mm[neighbour] += length;
      clusters_[neighbour].shared_mm.erase(from);
      clusters_[neighbour].shared_mm[into] += length;
    }
    ++a.version;
    b = Cluster{};
    Propose(into, false);
  }

  const TriangleMesh& mesh_;
  const SurfaceGraph& graph_;
  double total_area_ = 0;
  std::vector<Cluster> clusters_;
  std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> queue_;
};

}  // namespace

Result<std::vector<std::vector<std::uint32_t>>> GrowCharts(const TriangleMesh& mesh,
                                                           const SurfaceGraph& graph,
                                                           const ProgressFn& progress,
                                                           const std::stop_token& stop) {
  Growth growth(mesh, graph);
  SCAN_CHECK(growth.Run(progress, stop));
  return growth.Release();
}

}  // namespace scan
