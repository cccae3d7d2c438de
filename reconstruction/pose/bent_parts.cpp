#include "reconstruction/pose/bent_parts.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "drivers/base/units.h"
#include "reconstruction/pose/poses.h"
#include "reconstruction/pose/rigid_motion.h"
#include "reconstruction/pose/surface_cells.h"

namespace scan {
namespace {

// The residuals of a piece of surface, as a quadratic of a rigid motion about the mass centre.
struct Residuals {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  double squares = 0;                    // weighted
  double length_px = 0, squares_px = 0;  // by length
  double samples = 0;                    // independent ones

  Residuals& operator+=(const Residuals& other) {
    H += other.H;
    g += other.g;
    squares += other.squares;
    length_px += other.length_px;
    squares_px += other.squares_px;
    samples += other.samples;
    return *this;
  }
  double After(const Vector6d& motion) const {
    return squares + 2 * g.dot(motion) + motion.dot(H * motion);
  }
};

Residuals ResidualOf(const ViewFit& fit, const ContourMatch& match, const Eigen::Vector3d& centre,
                     double sigma_px) {
  // Residuals of clean outlines hang together over a few pixels; what real ones leave out besides
  // shows in the scatter that remains.
  constexpr double kCorrelationPx = 10;
  const ViewState& state = fit.evidence->state;
  EvidenceVector dr;
  const double r = ContourResidual(state, match.point, match.target, match.normal,
                                   state.camera_from_model * centre, &dr);
  const Eigen::Matrix3d model_from_camera = state.camera_from_model.rotation().transpose();
  Vector6d by_motion;
  by_motion << model_from_camera * dr.head<3>(), model_from_camera * dr.segment<3>(3);
  const double samples = match.share_px / kCorrelationPx;
  const double weight = samples / (sigma_px * sigma_px);
  return {weight * by_motion * by_motion.transpose(),
          weight * r * by_motion,
          weight * r * r,
          match.share_px,
          match.share_px * r * r,
          samples};
}

struct Bend {
  Vector6d motion = Vector6d::Zero();  // about the origin that the residuals were taken about
  double gain = 0;                     // of the log-likelihood
};

// The motion about the hinge that explains the residuals best. `tip`, `hinge`: from the origin.
Bend BestBend(const Residuals& part, const Eigen::Vector3d& tip, const Eigen::Vector3d& hinge,
              double length_mm, const BentPartOptions& options) {
  Eigen::Matrix<double, 3, 6> at_hinge;
  at_hinge << -Skew(hinge), Eigen::Matrix3d::Identity();
  const Eigen::Vector3d along = (tip - hinge).normalized();
  Matrix6d prior = Matrix6d::Zero();
  prior.topLeftCorner<3, 3>() = std::pow(options.bend_sigma_rad, -2) * Eigen::Matrix3d::Identity() +
                                std::pow(options.twist_sigma_rad, -2) * along * along.transpose();
  prior += std::pow(options.hinge_sigma_share * length_mm, -2) * at_hinge.transpose() * at_hinge;
  Bend bend;
  bend.motion = -(part.H + prior).ldlt().solve(part.g);
  bend.gain = 0.5 * (part.squares - part.After(bend.motion) - bend.motion.dot(prior * bend.motion));
  return bend;
}

// Moves the part on by `motion` about `origin`.
void Add(const Vector6d& motion, const Eigen::Vector3d& origin, BentPart& part) {
  const Eigen::Vector3d at = part.hinge + part.shift_mm;  // where its hinge is now
  part.rotation = ExpSo3(motion.head<3>()) * part.rotation;
  part.shift_mm += motion.tail<3>() + motion.head<3>().cross(at - origin);
}

constexpr double kCellShare = 0.03;  // of the mesh's radius
constexpr double kTipsApart = 4;     // cells

class PartSearch {
 public:
  PartSearch(const ContourMesh& mesh, std::span<const ViewFit> fits, const BentPartOptions& options)
      : mesh_(mesh),
        fits_(fits),
        options_(options),
        cells_(CellsOf(mesh, kCellShare * mesh.radius_mm)),
        residuals_(cells_.centre.size()),
        taken_(cells_.centre.size(), false),
        tips_(TipsOf(cells_, mesh.centre, kTipsApart * cells_.size_mm)),
        sigma_px_(PooledSigma(fits)) {
    for (const ViewFit& fit : fits_) {
      if (!fit.evidence) continue;
      for (const ContourMatch& match : fit.match.matches) {
        const Residuals r = ResidualOf(fit, match, mesh_.centre, sigma_px_);
        residuals_[CellOf(match)] += r;
        all_ += r;
      }
    }
  }

  // Of the bends that are believed, the one that explains most.
  std::optional<BentPart> Next() {
    std::vector<Candidate> candidates;
    for (const int tip : tips_) candidates.push_back(BestAt(tip));
    std::stable_sort(
        candidates.begin(), candidates.end(),
        [](const Candidate& a, const Candidate& b) { return a.bend.gain > b.bend.gain; });
    for (const Candidate& candidate : candidates) {
      if (candidate.bend.gain < options_.least_gain) break;
      if (auto part = Judged(candidate)) return part;
    }
    return std::nullopt;
  }

 private:
  struct Candidate {
    int tip = 0;  // cell
    double length_mm = 0;
    Eigen::Vector3d hinge = Eigen::Vector3d::Zero();
    Bend bend;
  };

  std::size_t CellOf(const ContourMatch& match) const {
    return static_cast<std::size_t>(cells_.of_vertex[match.vertices[0]]);
  }

  // The bend of what is around the tip, out to the distance at which it explains most.
  Candidate BestAt(int tip) const {
    const std::vector<double> way = DistancesFrom(cells_, {tip});
    std::vector<int> order;
    for (int c = 0; c < static_cast<int>(way.size()); ++c)
      if (std::isfinite(way[static_cast<std::size_t>(c)]) && !taken_[static_cast<std::size_t>(c)])
        order.push_back(c);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      return way[static_cast<std::size_t>(a)] < way[static_cast<std::size_t>(b)];
    });
    const double least_mm = 5 * cells_.size_mm;
    const auto most =
        static_cast<std::size_t>(options_.most_share * static_cast<double>(cells_.centre.size()));
    Candidate best;
    Residuals part;
    double next_mm = least_mm;
    for (std::size_t n = 0; n < order.size() && n < most; ++n) {
      const auto cell = static_cast<std::size_t>(order[n]);
      part += residuals_[cell];
      const bool last = n + 1 == order.size();
      if (way[cell] < (last ? least_mm : next_mm)) continue;
      if (part.length_px > options_.most_share * all_.length_px) break;
      next_mm = way[cell] + cells_.size_mm;
      Eigen::Vector3d hinge = Eigen::Vector3d::Zero();
      int rim = 0;
      for (std::size_t k = n + 1;
           k-- > 0 && way[static_cast<std::size_t>(order[k])] > way[cell] - 1.5 * cells_.size_mm;) {
        hinge += cells_.centre[static_cast<std::size_t>(order[k])];
        ++rim;
      }
      Candidate found{tip, way[cell], hinge / rim, {}};
      found.bend = BestBend(part, cells_.centre[static_cast<std::size_t>(tip)] - mesh_.centre,
                            found.hinge - mesh_.centre, found.length_mm, options_);
      if (found.bend.gain > best.bend.gain) best = found;
    }
    return best;
  }

  // The candidate as a part, whose cells are then taken; nothing when it is not believed.
  std::optional<BentPart> Judged(const Candidate& best) {
    const std::vector<double> way = DistancesFrom(cells_, {best.tip});
    const auto within = [&](std::size_t cell) {
      return way[cell] <= best.length_mm && !taken_[cell];
    };
    BentPart part;
    Residuals whole;
    for (const ViewFit& fit : fits_) {
      if (!fit.evidence) continue;
      Residuals view;
      for (const ContourMatch& match : fit.match.matches)
        if (within(CellOf(match))) view += ResidualOf(fit, match, mesh_.centre, sigma_px_);
      if (view.length_px <= 0) continue;
      whole += view;
      const double rms_px = std::sqrt(view.squares_px / view.length_px);
      if (rms_px > options_.least_sigmas * sigma_px_ &&
          view.After(best.bend.motion) < 0.5 * view.squares)
        ++part.views;
    }
    part.distance_px = std::sqrt(whole.squares_px / whole.length_px);
    const double after = std::max(0.0, whole.After(best.bend.motion));
    const double scatter = std::max(1.0, after / std::max(1.0, whole.samples - 6));
    if (part.distance_px < options_.least_sigmas * sigma_px_ ||
        after > (1 - options_.least_explained) * whole.squares ||
        best.bend.gain < options_.least_gain * scatter || part.views < options_.least_views)
      return std::nullopt;
    part.length_mm = best.length_mm;
    part.tip = cells_.centre[static_cast<std::size_t>(best.tip)];
    part.hinge = best.hinge;
    Add(best.bend.motion, mesh_.centre, part);
    const double band_mm = 2 * cells_.size_mm;
    for (std::uint32_t v = 0; v < cells_.of_vertex.size(); ++v) {
      const auto cell = static_cast<std::size_t>(cells_.of_vertex[v]);
      if (!within(cell)) continue;
      part.vertices.emplace_back(v, std::min(1.0, (best.length_mm - way[cell]) / band_mm));
      part.centre += mesh_.mesh.vertices[v];
    }
    part.centre /= static_cast<double>(part.vertices.size());
    for (std::size_t c = 0; c < taken_.size(); ++c)
      if (way[c] <= best.length_mm + band_mm) taken_[c] = true;
    return part;
  }

  const ContourMesh& mesh_;
  std::span<const ViewFit> fits_;
  const BentPartOptions& options_;
  SurfaceCells cells_;
  std::vector<Residuals> residuals_;
  std::vector<bool> taken_;
  std::vector<int> tips_;
  double sigma_px_;
  Residuals all_;
};

}  // namespace

std::vector<BentPart> FindBentParts(const ContourMesh& mesh, std::span<const ViewFit> fits,
                                    const BentPartOptions& options) {
  constexpr std::size_t kMost = 6;
  std::vector<BentPart> parts;
  PartSearch search(mesh, fits, options);
  while (parts.size() < kMost) {
    auto next = search.Next();
    if (!next) break;
    parts.push_back(std::move(*next));
  }
  return parts;
}

void RefineBends(const ContourMesh& bent, std::span<const ViewFit> fits,
                 const BentPartOptions& options, std::vector<BentPart>& parts) {
  const double sigma_px = PooledSigma(fits);
  std::vector<int> part_of(bent.mesh.vertices.size(), -1);
  for (std::size_t p = 0; p < parts.size(); ++p)
    for (const auto& [vertex, share] : parts[p].vertices)
      if (share >= 1) part_of[vertex] = static_cast<int>(p);
  std::vector<Residuals> residuals(parts.size());
  for (const ViewFit& fit : fits) {
    if (!fit.evidence) continue;
    for (const ContourMatch& match : fit.match.matches) {
      const int p = part_of[match.vertices[0]];
      if (p < 0 || part_of[match.vertices[1]] != p) continue;
      residuals[static_cast<std::size_t>(p)] += ResidualOf(fit, match, bent.centre, sigma_px);
    }
  }
  for (std::size_t p = 0; p < parts.size(); ++p) {
    BentPart& part = parts[p];
    const Eigen::Vector3d hinge = part.hinge + part.shift_mm;
    const Eigen::Vector3d tip = hinge + part.rotation * (part.tip - part.hinge);
    const Bend bend =
        BestBend(residuals[p], tip - bent.centre, hinge - bent.centre, part.length_mm, options);
    Add(bend.motion, bent.centre, part);
  }
}

TriangleMesh WithBends(const TriangleMesh& mesh, std::span<const BentPart> parts) {
  TriangleMesh bent = mesh;
  for (const BentPart& part : parts) {
    for (const auto& [vertex, share] : part.vertices) {
      const Eigen::Vector3d& x = mesh.vertices[vertex];
      const Eigen::Vector3d there = part.hinge + part.rotation * (x - part.hinge) + part.shift_mm;
      bent.vertices[vertex] += share * (there - x);
    }
  }
  return bent;
}

std::string BentPartNote(const BentPart& part) {
  const Eigen::AngleAxisd turn(part.rotation);
  return fmt::format(
      "The part around ({:.1f}, {:.1f}, {:.1f}) mm of the model frame, about {:.1f} mm long, "
      "stands {:.1f} px off in {} views: it was probably bent since the CT, by about {:.1f}°. The "
      "poses allow for that; colours on it may be misplaced.",
      part.centre.x(), part.centre.y(), part.centre.z(), part.length_mm, part.distance_px,
      part.views, DegFromRad(turn.angle()));
}

}  // namespace scan
