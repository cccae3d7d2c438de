// Prints how far single-view poses stay from the Cramer-Rao bound.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "reconstruction/specimens/specimen.h"
#include "tests/accuracy/efficiency.h"

int main(int argc, char** argv) {
  using namespace scan;
  Fig12Options fig12;
  ContourNoise noise;
  double bias_sigma_px = 0.02;
  std::string specimen = "beetle";
  std::vector<double> sigmas{0.5};
  fig12.w = 1848;
  CLI::App app("RMS errors of single views over their Cramer-Rao bounds");
  app.add_option("--specimen", specimen)->capture_default_str();
  app.add_option("--width", fig12.w)->check(CLI::Range(120, 8000))->capture_default_str();
  app.add_option("--focal-mm", fig12.focal_mm)
      ->check(CLI::Range(10.0, 1000.0))
      ->capture_default_str();
  app.add_option("--views", fig12.cameras)->check(CLI::Range(1, 10000))->capture_default_str();
  app.add_option("--seed", fig12.seed)->capture_default_str();
  app.add_option("--noise-px", sigmas)->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--noise-length-px", noise.correlation_px)
      ->check(CLI::Range(0.5, 1000.0))
      ->capture_default_str();
  app.add_option("--bias-px", noise.bias_px)->capture_default_str();
  app.add_option("--bias-sigma-px", bias_sigma_px, "prior")->capture_default_str();
  bool binary = false;
  app.add_flag("--binary", binary, "binary masks as well");
  CLI11_PARSE(app, argc, argv);
  fig12.h = static_cast<int>(std::lround(fig12.w * 2448.0 / 3696));
  const auto made = MakeSpecimen(specimen);
  if (!made) {
    fmt::print(stderr, "{}\n", ToString(made.error()));
    return 1;
  }
  const test::EfficiencyBench bench(ExactSurface(**made, 0.35), fig12);
  for (std::size_t k = 0; k < (binary ? 2 : 1) * sigmas.size(); ++k) {
    noise.binary = k >= sigmas.size();
    noise.sigma_px = sigmas[k % sigmas.size()];
    const auto e = bench.Measure(noise, bias_sigma_px);
    if (!e) {
      fmt::print(stderr, "{}\n", ToString(e.error()));
      return 1;
    }
    fmt::print(
        "{} {} x {} f {:g}{}: noise {:g} px, bias {:g} px: {} of {} accepted; centre RMS {:.4f} "
        "mm = {:.3f} x bound {:.4f} (worst view {:.2f} x); surface RMS {:.4f} px = {:.3f} x bound "
        "{:.4f}; mean NEES {:.2f}; skipped {:.1f} %\n",
        specimen, fig12.w, fig12.h, fig12.focal_mm, noise.binary ? " binary" : "", noise.sigma_px,
        noise.bias_px, e->accepted, e->views, e->centre_rms_mm, e->centre_ratio, e->centre_bound_mm,
        e->worst_centre_ratio, e->surface_rms_px, e->surface_ratio, e->surface_bound_px,
        e->mean_nees, 100 * e->skipped);
    std::fflush(stdout);
  }
  return 0;
}
