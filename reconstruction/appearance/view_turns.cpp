#include "reconstruction/appearance/view_turns.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "drivers/base/units.h"

namespace scan {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Smoothed colours of all views in units of their noise.
using SmoothViews = std::vector<ColourMaps>;

SmoothViews SmoothAll(const TurningGrid& grid, std::span<const ViewColours> views,
                      const std::array<double, kColourChannels>& noise, double sigma_mm) {
  SmoothViews smooth(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    for (std::size_t c = 0; c < kColourChannels; ++c) {
      smooth[v][c] = Smoothed(views[v].colour[c], grid, sigma_mm);
      for (float& value : smooth[v][c].value) value /= static_cast<float>(std::max(noise[c], 1e-6));
    }
  }
  return smooth;
}

// Normal equations of the views' turns (in nodes), and the gradient of each band of rings.
struct TurnSystem {
  MatrixXd H;
  MatrixXd gradient;  // views x bands
};

void AddNode(const SmoothViews& views, std::size_t channel, int ring, int azimuth,
             const VectorXd& turns, MatrixXd& H, Eigen::Ref<VectorXd> gradient) {
  struct Seen {
    int view;
    double value, slope, weight;
  };
  std::vector<Seen> seen;
  double mean = 0, sum = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto at = static_cast<int>(v);
    const MapSample s = SampleRing(views[v][channel], ring, azimuth + turns[at]);
    if (!(s.weight > 0)) continue;
    seen.push_back({at, s.value, s.slope, s.weight});
    mean += seen.back().weight * seen.back().value;
    sum += seen.back().weight;
  }
  if (seen.size() < 2) return;
  mean /= sum;
  for (const Seen& a : seen) {
    gradient[a.view] += a.weight * a.slope * (a.value - mean);
    H(a.view, a.view) += a.weight * a.slope * a.slope;
    for (const Seen& b : seen) H(a.view, b.view) -= a.weight * a.slope * b.weight * b.slope / sum;
  }
}

// Every `stride`-th node.
TurnSystem SystemOf(const SmoothViews& views, const VectorXd& turns, int bands, int stride) {
  const auto count = static_cast<Eigen::Index>(views.size());
  const int rings = views[0][0].rings, azimuths = views[0][0].azimuths;
  std::vector<MatrixXd> H(static_cast<std::size_t>(bands), MatrixXd::Zero(count, count));
  TurnSystem system{MatrixXd::Zero(count, count), MatrixXd::Zero(count, bands)};
  tbb::parallel_for(0, bands, [&](int band) {
    for (int j = rings * band / bands; j < rings * (band + 1) / bands; ++j)
      for (int k = 0; k < azimuths; k += stride)
        for (std::size_t c = 0; c < kColourChannels; ++c)
          AddNode(views, c, j, k, turns, H[static_cast<std::size_t>(band)],
                  system.gradient.col(band));
  });
  for (const MatrixXd& h : H) system.H += h;
  return system;
}

}  // namespace

std::vector<ViewTurn> ViewTurns(const TurningGrid& grid, std::span<const ViewColours> views,
                                const std::array<double, kColourChannels>& noise,
                                const ViewTurnOptions& options) {
  std::vector<ViewTurn> result(views.size());
  if (views.empty() || grid.rings == 0) return result;
  const auto count = static_cast<Eigen::Index>(views.size());
  VectorXd turns = VectorXd::Zero(count), sigma = VectorXd::Zero(count);
  VectorXd information = VectorXd::Zero(count);
  const double widest_node_mm =
      grid.step_rad() * *std::max_element(grid.radius_mm.begin(), grid.radius_mm.end());
  constexpr double kSettled = 0.01;  // nodes
  for (const double nodes : options.smoothing_nodes) {
    const int stride = std::max(2, static_cast<int>(nodes / 2));
    const SmoothViews smooth = SmoothAll(grid, views, noise, nodes * widest_node_mm);
    for (int round = 0; round < options.rounds; ++round) {
      TurnSystem system = SystemOf(smooth, turns, options.bands, stride);
      information = system.H.diagonal();
      // The prior is weak beside any overlap: nodes count as if they were independent.
      const double prior = std::pow(grid.step_rad() / options.prior_sigma_rad, 2);
      system.H.diagonal().array() += prior;
      const Eigen::LDLT<MatrixXd> solver(system.H);
      // A step is a few nodes at most: slopes are good no farther.
      const VectorXd step = solver.solve(system.gradient.rowwise().sum() + prior * turns)
                                .cwiseMax(-6.0)
                                .cwiseMin(6.0);
      turns -= step;
      const MatrixXd influence = solver.solve(system.gradient);
      sigma =
          (influence.rowwise().squaredNorm() * options.bands / (options.bands - 1.0)).cwiseSqrt();
      if (step.cwiseAbs().maxCoeff() < kSettled) break;
    }
  }
  if (information.sum() > 0) turns.array() -= information.dot(turns) / information.sum();
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto at = static_cast<Eigen::Index>(v);
    if (!(information[at] > 0)) {
      result[v].sigma_rad = std::numeric_limits<double>::infinity();
      continue;
    }
    result[v] = {turns[at] * grid.step_rad(), sigma[at] * grid.step_rad()};
  }
  return result;
}

ViewColours Turned(const ViewColours& view, double turn_rad) {
  ViewColours out = view;
  for (RingMap& map : out.colour) {
    const RingMap from = map;
    const double nodes = turn_rad * from.azimuths / (2 * kPi);
    for (int j = 0; j < from.rings; ++j) {
      for (int k = 0; k < from.azimuths; ++k) {
        const MapSample s = SampleRing(from, j, k + nodes);
        map.value[from.index(j, k)] = s.value;
        map.weight[from.index(j, k)] = s.weight;
      }
    }
  }
  return out;
}

}  // namespace scan
