#include "reconstruction/fiducials/find_beads.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "drivers/base/units.h"
#include "reconstruction/volume/threshold.h"
#include "reconstruction/volume/voxel_set.h"

namespace scan {
namespace {

constexpr int kDirections = 400;
constexpr int kRoughly = 80;        // directions of a first look
constexpr double kFarthest = 1.6;   // radii; outside of the ball, profiles end there
constexpr double kLeastSeen = 0.6;  // share of the directions in which a boundary is found
constexpr double kAsDense = 0.75;   // of the densest ball's contrast: beads are of one material
constexpr double kLeastVoxels = 4;  // along a diameter
// Of a centre, voxels: where tissue on one side and air on the other meet at a bead's rim, half way
// is no place of its own; the tests' three beads, half sunk, are found 0.07 voxel off.
constexpr double kLeastSigma = 0.1;

// Grey between voxels; nothing outside of the volume.
std::optional<double> GreyAt(const Volume& volume, const Eigen::Vector3d& point) {
  const Eigen::Vector3d index =
      (volume.direction.transpose() * (point - volume.origin_mm)).cwiseQuotient(volume.spacing_mm);
  std::array<std::size_t, 3> low{};
  Eigen::Vector3d t;
  for (int a = 0; a < 3; ++a) {
    const auto axis = static_cast<std::size_t>(a);
    if (!(index[a] >= 0) || index[a] > static_cast<double>(volume.size[axis] - 1)) return {};
    low[axis] = std::min(static_cast<std::size_t>(index[a]),
                         volume.size[axis] > 1 ? volume.size[axis] - 2 : 0);
    t[a] = index[a] - static_cast<double>(low[axis]);
  }
  double sum = 0;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::size_t di = corner & 1, dj = corner >> 1 & 1, dk = corner >> 2;
    const double w = (di ? t[0] : 1 - t[0]) * (dj ? t[1] : 1 - t[1]) * (dk ? t[2] : 1 - t[2]);
    if (w == 0) continue;
    sum += w * volume.grey[volume.index(low[0] + di, low[1] + dj, low[2] + dk)];
  }
  return sum;
}

// Evenly spread over the sphere (Fibonacci lattice).
Eigen::Vector3d Direction(int i, int count) {
  const double z = 1 - (2 * i + 1.0) / count;
  const double angle = i * kPi * (3 - std::sqrt(5.0)), r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Boundary {
  std::vector<Eigen::Vector3d> points;
  double inside = 0, outside = 0;  // grey; outside: median over the points
};

// Where the ball ends along rays from `centre`; `radius_mm` as expected.
Boundary BoundaryOf(const Volume& volume, const Eigen::Vector3d& centre, double radius_mm,
                    int directions) {
  const double step = std::min(0.25 * volume.spacing_mm.minCoeff(), 0.05 * radius_mm);
  std::vector<double> inner;
  for (int i = 0; i < directions; i += 4)
    if (const auto grey = GreyAt(volume, centre + 0.4 * radius_mm * Direction(i, directions)))
      inner.push_back(*grey);
  if (inner.empty()) return {};
  Boundary boundary;
  boundary.inside = Median(inner);
  const double inside = boundary.inside;
  std::vector<double> profile, outsides;
  for (int i = 0; i < directions; ++i) {
    const Eigen::Vector3d along = Direction(i, directions);
    profile.clear();
    for (double r = 0.4 * radius_mm; r < kFarthest * radius_mm; r += step) {
      const auto grey = GreyAt(volume, centre + r * along);
      if (!grey) break;
      profile.push_back(*grey);
    }
    const auto at = [&](double radii) {
      return static_cast<std::size_t>((radii - 0.4) * radius_mm / step);
    };
    if (profile.size() <= at(1.45)) continue;
    const auto from = profile.begin() + static_cast<std::ptrdiff_t>(at(1.25));
    const double outside = Median(
        {from, profile.begin() + static_cast<std::ptrdiff_t>(std::min(at(1.5), profile.size()))});
    // Another bead beside it or denser matter: no boundary there.
    if (outside > 0.95 * inside && outside > inside - 0.05 * std::abs(inside)) continue;
    const double half = 0.5 * (inside + outside);
    for (std::size_t k = 1; k < profile.size(); ++k) {
      if (profile[k] >= half) continue;
      const double t = (profile[k - 1] - half) / (profile[k - 1] - profile[k]);
      const double r = 0.4 * radius_mm + step * (static_cast<double>(k - 1) + std::max(0.0, t));
      boundary.points.push_back(centre + r * along);
      outsides.push_back(outside);
      break;
    }
  }
  if (!outsides.empty()) boundary.outside = Median(outsides);
  return boundary;
}

struct Candidate {
  std::size_t first = 0;  // voxel
  std::size_t voxels = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
};

std::vector<Candidate> CandidatesAbove(const Volume& volume, double threshold,
                                       const FindBeadsOptions& options) {
  VoxelSet set{volume.size, std::vector<std::uint8_t>(volume.voxels())};
  for (std::size_t v = 0; v < volume.voxels(); ++v) set.inside[v] = volume.grey[v] >= threshold;
  const Labelling labelling = LabelComponents(set, Connectivity::faces);
  const double ball = kPi / 6 * std::pow(options.diameter_mm, 3) / volume.spacing_mm.prod();
  std::vector<Candidate> all(labelling.components.size());
  std::size_t v = 0;
  for (std::size_t k = 0; k < volume.size[2]; ++k)
    for (std::size_t j = 0; j < volume.size[1]; ++j)
      for (std::size_t i = 0; i < volume.size[0]; ++i, ++v) {
        if (labelling.label[v] == 0) continue;
        Candidate& c = all[labelling.label[v] - 1];
        if (c.voxels++ == 0) c.first = v;
        c.centre +=
            Eigen::Vector3d(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
      }
  std::vector<Candidate> candidates;
  for (Candidate& c : all) {
    const auto n = static_cast<double>(c.voxels);
    // A high threshold leaves only the core of a ball that the scanner blurs.
    if (n < 0.1 * ball || n > 2.5 * ball) continue;
    c.centre = volume.origin_mm +
               volume.direction * volume.spacing_mm.cwiseProduct(Eigen::Vector3d(c.centre / n));
    candidates.push_back(c);
  }
  return candidates;
}

struct Ball {
  Bead bead;
  std::size_t first = 0;           // voxel of the component
  double inside = 0, outside = 0;  // grey
};

bool IsRound(const Bead& bead, double radius_mm, double slack, const FindBeadsOptions& options) {
  return std::abs(bead.radius_mm / radius_mm - 1) <= slack * options.diameter_tolerance &&
         bead.residual_mm <= slack * options.roundness * bead.radius_mm;
}

std::optional<Ball> FitBall(const Volume& volume, const Candidate& candidate, double radius_mm,
                            const FindBeadsOptions& options) {
  constexpr int kRounds = 4;
  Ball ball;
  ball.first = candidate.first;
  ball.bead.centre = candidate.centre;
  for (int round = 0; round < kRounds; ++round) {
    const int directions = round == 0 ? kRoughly : kDirections;
    const Boundary boundary = BoundaryOf(volume, ball.bead.centre, radius_mm, directions);
    const auto count = static_cast<double>(boundary.points.size());
    if (count < kLeastSeen * directions) return {};
    const auto fitted = FitSphere(boundary.points);
    if (!fitted || (fitted->centre - candidate.centre).norm() > radius_mm) return {};
    ball.bead = *fitted;
    ball.inside = boundary.inside;
    ball.outside = boundary.outside;
    if (round == 0 && !IsRound(ball.bead, radius_mm, 2, options)) break;
    // Rays closer together than voxels see the same noise.
    const double patches = 4 * kPi * ball.bead.radius_mm * ball.bead.radius_mm /
                           std::pow(volume.spacing_mm.maxCoeff(), 2);
    ball.bead.sigma_mm *= std::sqrt(std::max(1.0, count / patches));
    ball.bead.sigma_mm = std::max(ball.bead.sigma_mm, kLeastSigma * volume.spacing_mm.maxCoeff());
  }
  return ball;
}

// The balls of all levels, from the highest down to where beads would merge with what they sit in.
struct Search {
  std::vector<Ball> balls;
  std::optional<Bead> nearest;  // of those that are none
};

Search SearchLevels(const Volume& volume, const std::vector<double>& ascending, double radius_mm,
                    const FindBeadsOptions& options) {
  constexpr double kMerged = 0.3;
  Search search;
  double lowest = -std::numeric_limits<double>::infinity();
  for (auto level = ascending.rbegin(); level != ascending.rend() && *level >= lowest; ++level) {
    for (const Candidate& candidate : CandidatesAbove(volume, *level, options)) {
      const auto ball = FitBall(volume, candidate, radius_mm, options);
      if (!ball) continue;
      if (!IsRound(ball->bead, radius_mm, 1, options)) {
        if (!search.nearest || ball->bead.residual_mm < search.nearest->residual_mm)
          search.nearest = ball->bead;
        continue;
      }
      lowest = std::max(lowest, ball->outside + kMerged * (ball->inside - ball->outside));
      const auto same =
          std::find_if(search.balls.begin(), search.balls.end(), [&](const Ball& other) {
            return (other.bead.centre - ball->bead.centre).norm() < radius_mm;
          });
      if (same == search.balls.end())
        search.balls.push_back(*ball);
      else if (ball->bead.residual_mm < same->bead.residual_mm)
        *same = *ball;
    }
  }
  return search;
}

}  // namespace

std::optional<Bead> FitSphere(const std::vector<Eigen::Vector3d>& points) {
  if (points.size() < 4) return {};
  // |p|^2 = 2 c p + (r^2 - |c|^2) is linear: the start.
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix4d M = Eigen::Matrix4d::Zero();
  Eigen::Vector4d m = Eigen::Vector4d::Zero();
  for (const auto& p : points) {
    const Eigen::Vector3d q = p - mean;
    const Eigen::Vector4d row(2 * q.x(), 2 * q.y(), 2 * q.z(), 1);
    M += row * row.transpose();
    m += q.squaredNorm() * row;
  }
  const Eigen::FullPivLU<Eigen::Matrix4d> lu(M);
  if (!lu.isInvertible()) return {};
  const Eigen::Vector4d start = lu.solve(m);
  Eigen::Vector3d c = start.head<3>();
  double radius = std::sqrt(std::max(0.0, start[3] + c.squaredNorm()));
  Bead bead;
  for (int round = 0; round < 12; ++round) {
    std::vector<double> magnitude;
    for (const auto& p : points) magnitude.push_back(std::abs((p - mean - c).norm() - radius));
    const double limit = std::max(4.685 * 1.4826 * Median(magnitude), 1e-9);
    M.setZero();
    m.setZero();
    double kept = 0, squares = 0;
    for (const auto& p : points) {
      const Eigen::Vector3d from = p - mean - c;
      const double distance = from.norm(), r = distance - radius;
      if (std::abs(r) > limit || distance <= 0) continue;
      Eigen::Vector4d row;
      row << -from / distance, -1;
      const double w = std::pow(1 - r * r / (limit * limit), 2);  // Tukey
      M += w * row * row.transpose();
      m -= w * r * row;
      kept += w;
      squares += w * r * r;
    }
    const Eigen::LDLT<Eigen::Matrix4d> solver(M + 1e-12 * Eigen::Matrix4d::Identity());
    const Eigen::Vector4d step = solver.solve(m);
    if (!step.allFinite()) return {};
    c += step.head<3>();
    radius += step[3];
    bead.residual_mm = std::sqrt(squares / std::max(kept, 1e-9));
    bead.sigma_mm = bead.residual_mm * std::sqrt(3 / std::max(kept, 1.0));
    if (step.norm() < 1e-10) break;
  }
  bead.centre = mean + c;
  bead.radius_mm = radius;
  return bead;
}

Result<std::vector<Bead>> FindBeads(const Volume& volume, const FindBeadsOptions& options) {
  const double radius = 0.5 * options.diameter_mm;
  if (volume.voxels() == 0) return BadInput("an empty volume", "beads", "give another volume");
  if (!(options.diameter_mm >= kLeastVoxels * volume.spacing_mm.maxCoeff()))
    return BadInput(fmt::format("beads of {:g} mm are too small for voxels of {:.3g} mm",
                                options.diameter_mm, volume.spacing_mm.maxCoeff()),
                    "--bead-mm", "state the diameter in mm; it needs four voxels");
  std::vector<double> levels;
  if (options.threshold)
    levels = {*options.threshold};
  else
    levels = OtsuLevels(volume, 2, 5);
  Search search = SearchLevels(volume, levels, radius, options);
  if (search.balls.empty()) {
    std::string nearest = "nothing of about that volume is denser than what is around it";
    if (search.nearest)
      nearest = fmt::format(
          "nearest is a body {:.2f} mm across whose boundary strays from a ball's by {:.3f} mm RMS "
          "at ({:.2f}, {:.2f}, {:.2f}) mm",
          2 * search.nearest->radius_mm, search.nearest->residual_mm, search.nearest->centre.x(),
          search.nearest->centre.y(), search.nearest->centre.z());
    return BadInput(
        fmt::format("no ball of {:g} mm found in the volume: {}", options.diameter_mm, nearest),
        "--bead-mm", "state the beads' diameter, or leave the option out");
  }
  const Ball densest =
      *std::max_element(search.balls.begin(), search.balls.end(),
                        [](const Ball& a, const Ball& b) { return a.inside < b.inside; });
  const double least = densest.outside + kAsDense * (densest.inside - densest.outside);
  std::erase_if(search.balls, [&](const Ball& ball) { return ball.inside < least; });
  std::sort(search.balls.begin(), search.balls.end(),
            [](const Ball& a, const Ball& b) { return a.first < b.first; });
  std::vector<Bead> beads;
  for (const Ball& ball : search.balls) beads.push_back(ball.bead);
  return beads;
}

}  // namespace scan
