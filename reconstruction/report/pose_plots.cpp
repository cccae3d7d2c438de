#include "reconstruction/report/pose_plots.h"

#include <fmt/format.h>

#include <algorithm>

namespace scan {
namespace {

template <class Value>
PlotSeries OverSteps(const PoseDiagnostics& diagnostics, const std::string& name, Value&& value) {
  PlotSeries series{name, {}};
  for (std::size_t i = 0; i < diagnostics.steps.size(); ++i)
    series.points.emplace_back(static_cast<double>(i + 1), value(diagnostics.steps[i]));
  return series;
}

// Where the solve began again, but for its start.
std::vector<PlotGuide> Restarts(const PoseDiagnostics& diagnostics) {
  std::vector<PlotGuide> guides;
  for (std::size_t i = 1; i < diagnostics.steps.size(); ++i)
    if (diagnostics.steps[i].restart)
      guides.push_back({PlotGuide::At::x, static_cast<double>(i) + 0.5, "again"});
  return guides;
}

PlotSeries Eigenvalues(const Spectrum& spectrum, const std::string& name) {
  PlotSeries series{name, {}};
  for (std::size_t i = 0; i < spectrum.lines.size(); ++i)
    series.points.emplace_back(static_cast<double>(i + 1), spectrum.lines[i].eigenvalue);
  return series;
}

}  // namespace

Plot ConvergencePlot(const PoseDiagnostics& diagnostics) {
  Plot plot;
  plot.x = {.label = "iteration", .whole = true};
  plot.y = {.label = "px, full size", .log = true};
  plot.series = {
      OverSteps(diagnostics, "match window", [](const auto& s) { return s.window_px; }),
      OverSteps(diagnostics, "largest motion", [](const auto& s) { return s.moved_px; }),
      OverSteps(diagnostics, "residual scale", [](const auto& s) { return s.residual_px; })};
  plot.guides = Restarts(diagnostics);
  plot.guides.push_back({PlotGuide::At::y, diagnostics.converged_px, "converged below"});
  return plot;
}

Plot CostPlot(const PoseDiagnostics& diagnostics) {
  Plot plot;
  plot.x = {.label = "iteration", .whole = true};
  plot.y = {.label = "cost: half the sum of squares, each over its sigma", .log = true};
  plot.series = {OverSteps(diagnostics, "", [](const auto& s) { return s.cost; })};
  plot.guides = Restarts(diagnostics);
  return plot;
}

Plot SpectrumPlot(const Spectrum& solve) {
  Plot plot;
  plot.x = {.label = "eigenvalue in order", .whole = true};
  plot.y = {.label = "information per squared prior sigma", .log = true};
  plot.series = {Eigenvalues(solve, "")};
  plot.guides = {{PlotGuide::At::y, 1, "from the prior alone"}};
  return plot;
}

Plot PlacingPlot(const std::vector<Spectrum>& placings) {
  Plot plot;
  plot.x = {.label = "eigenvalue in order", .whole = true};
  plot.y = {.label = "information, 1 / mm^2", .log = true};
  for (const Spectrum& placing : placings) {
    PlotSeries series = Eigenvalues(placing, "mounting " + placing.of);
    series.style = PlotSeries::Style::stem;
    // Beside each other.
    const double shift = placings.size() < 2 ? 0 : 0.1 * static_cast<double>(plot.series.size());
    for (Eigen::Vector2d& point : series.points) point.x() += shift;
    if (placings.size() == 1)
      for (const SpectrumLine& line : placing.lines) series.labels.push_back(line.parameter);
    plot.series.push_back(std::move(series));
  }
  return plot;
}

std::size_t HardlyInformed(const Spectrum& solve) {
  return static_cast<std::size_t>(
      std::count_if(solve.lines.begin(), solve.lines.end(),
                    [](const SpectrumLine& line) { return line.eigenvalue < 2; }));
}

std::string LeastDetermined(const Spectrum& spectrum, std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < std::min(count, spectrum.lines.size()); ++i) {
    const SpectrumLine& line = spectrum.lines[i];
    text += fmt::format("{}{} ({:.3g})", i > 0 ? ", " : "", line.parameter, line.eigenvalue);
  }
  return text;
}

}  // namespace scan
