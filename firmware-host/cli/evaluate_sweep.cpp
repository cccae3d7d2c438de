#include "firmware-host/cli/evaluate_sweep.h"

#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "drivers/base/files.h"
#include "firmware-host/cli/figures.h"
#include "reconstruction/report/plot.h"

namespace scan {
namespace {

constexpr std::array<double, 5> kNoisePx{0, 0.25, 0.5, 1, 2};
constexpr std::array<double, 4> kPriorDegAndMm{0.02, 0.1, 0.5, 2};

struct SweptFigure {
  const char* label;
  double (*median)(const MethodSummary&);
};
constexpr std::array<SweptFigure, 3> kSweptFigures{{
    {"camera centre, mm", [](const MethodSummary& s) { return s.centre_mm.median; }},
    {"rotation, deg", [](const MethodSummary& s) { return s.rotation_deg.median; }},
    {"surface, px RMS", [](const MethodSummary& s) { return s.surface_px.median; }},
}};

// Medians of the accepted views' errors, side by side.
cv::Mat SweepPicture(std::span<const SweepPoint> points, const PlotAxis& at) {
  cv::Mat pictures;
  for (const SweptFigure& figure : kSweptFigures) {
    Plot plot;
    plot.x = at;
    plot.y = {.label = figure.label, .log = true};
    plot.series = {{"with logged poses", {}}, {"without", {}}};
    for (const SweepPoint& point : points)
      if (point.summary.accepted > 0)
        plot.series[point.priors ? 0 : 1].points.emplace_back(point.at,
                                                              figure.median(point.summary));
    const cv::Mat picture = DrawPlot(plot, {420, 320}).picture;
    if (picture.empty()) continue;
    if (pictures.empty())
      pictures = picture;
    else
      cv::hconcat(pictures, picture, pictures);
  }
  return pictures;
}

Status WritePlot(const std::filesystem::path& file, const cv::Mat& picture) {
  if (picture.empty())
    return Failed("there is nothing to plot: no pose was accepted", file.string(),
                  "look at the table");
  std::vector<uchar> png;
  cv::imencode(".png", picture, png);
  return WriteFileDurably(file, std::string(png.begin(), png.end()));
}

}  // namespace

Result<CommandOutput> RunSweep(const PoseTrial& trial, SweepOf what, const SweepOptions& options,
                               const std::filesystem::path& plot, const CliContext& context) {
  const bool noise = what == SweepOf::noise;
  SCAN_TRY(const std::vector<SweepPoint> points,
           noise ? SweepNoise(trial, kNoisePx, options, context.progress, context.stop)
                 : SweepPriors(trial, kPriorDegAndMm, options, context.progress, context.stop));
  const PlotAxis at{
      .label = noise ? "sigma of the outlines, px" : "sigma of the logged poses, deg and mm",
      .log = !noise};
  if (!plot.empty()) SCAN_CHECK(WritePlot(plot, SweepPicture(points, at)));
  Json rows = Json::array();
  for (const SweepPoint& point : points)
    rows.push_back({{noise ? "noise_px" : "logged_sigma_deg_and_mm", point.at},
                    {"with_logged_poses", point.priors},
                    {"views", point.summary.views},
                    {"accepted", point.summary.accepted},
                    {"accepted_wrong", point.summary.wrong},
                    {"centre_mm", ToJson(point.summary.centre_mm)},
                    {"rotation_deg", ToJson(point.summary.rotation_deg)},
                    {"surface_rms_px", ToJson(point.summary.surface_px)}});
  return CommandOutput{{{"sweep", rows}},
                       TableOf(points, noise ? "outlines stray by, px" : "logged sigma, deg + mm")};
}

}  // namespace scan
