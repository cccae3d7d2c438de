// Prints how well real photographs are posed on the visual hull of others of the same set.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <functional>

#include "tests/accuracy/real_sets/hull_trial.h"

namespace scan::test {
namespace {

void PrintSpread(const char* what, const Spread& s, const char* unit) {
  fmt::print("  {:<44} median {:.3f}, p95 {:.3f}, max {:.3f} {}\n", what, s.median, s.p95, s.max,
             unit);
}

Status Run(const std::string& name, const RealSet& set, const HullTrialOptions& options,
           bool per_view, const std::filesystem::path& overlay) {
  SCAN_TRY(const HullTrial trial, RunHullTrial(set, options));
  SCAN_TRY(const HullFigures figures, FiguresOf(trial));
  const auto whole = std::count(set.whole.begin(), set.whole.end(), true);
  fmt::print(
      "{}: {} photographs, {} whole; hull of {} ({} faces, {:.1f} s); {} posed, {} accepted "
      "({:.1f} s)\n",
      name, set.whole.size(), whole, trial.hull_views, trial.hull.faces.size(), trial.hull_seconds,
      trial.posed.truth.size(), figures.accepted, trial.solve_seconds);
  const CalibratedFigures& c = figures.calibrated;
  PrintSpread("hull's outline to the photograph's", c.contour.px, "px");
  PrintSpread("the same at the calibrated cameras", c.contour_calibrated.px, "px");
  if (!figures.nominal_deg.empty())
    PrintSpread("nominal rotation against the calibrated", SpreadOf(figures.nominal_deg), "deg");
  PrintSpread("rotation against the calibrated camera", SpreadOf(figures.rotation_deg), "deg");
  PrintSpread("the same after one alignment", c.aligned_deg, "deg");
  PrintSpread("of it about the model's z axis", SpreadOf(figures.azimuth_deg), "deg");
  PrintSpread("the solver's own sigma of the rotation", SpreadOf(figures.sigma_deg), "deg");
  PrintSpread("camera centre", SpreadOf(figures.centre_mm), "mm");
  for (const auto& [what, estimate] : trial.poses.nuisances)
    fmt::print("  {} {:.3f}, sigma {:.3f}\n", what, estimate.value, estimate.sigma);
  for (const std::string& note : trial.poses.notes) fmt::print("  {}\n", note);
  for (std::size_t i = 0; i < trial.poses.views.size(); ++i) {
    const ViewPose& view = trial.poses.views[i];
    if (per_view)
      fmt::print("  {}: {:.3f} deg, {:.2f} mm, contour rms {:.2f} px {}\n", view.name,
                 figures.rotation_deg[i], figures.centre_mm[i], view.contour_rms_px, view.reason);
    if (!overlay.empty()) SCAN_CHECK(WriteOverlay(trial, i, overlay / (view.name + ".png")));
  }
  return {};
}

}  // namespace
}  // namespace scan::test

int main(int argc, char** argv) {
  using namespace scan;
  std::filesystem::path data, overlay;
  bool per_view = false;
  test::HullTrialOptions options;
  std::string only;
  CLI::App app("Poses of real photographs on the visual hull of the others");
  app.add_option("data", data, "folder of middlebury_dino and apple_aruco_board")->required();
  app.add_option("--set", only, "apple-off: its nominal camera is off by 1 degree, 5 mm")
      ->check(CLI::IsMember({"dino", "apple", "apple-off"}));
  app.add_option("--overlay", overlay, "folder for pictures of every posed photograph");
  app.add_flag("--per-view", per_view);
  app.add_flag("--hull-of-all", options.hull_of_all,
               "as a control: the posed photographs carve the hull as well");
  CLI11_PARSE(app, argc, argv);
  using Load = std::function<std::optional<test::RealSet>()>;
  const std::pair<std::string, Load> sets[] = {
      {"dino", [&] { return test::LoadDino(data / "middlebury_dino"); }},
      {"apple", [&] { return test::LoadApple(data / "apple_aruco_board", {}); }},
      {"apple-off", [&] {
         return test::LoadApple(data / "apple_aruco_board", {1, 5});
       }}};
  for (const auto& [name, load] : sets) {
    if (!only.empty() && only != name) continue;
    const auto set = load();
    if (!set) {
      fmt::print(stderr, "the photographs of {} are not in {}\n", name, data.string());
      return 1;
    }
    if (const Status status = test::Run(name, *set, options, per_view, overlay); !status) {
      fmt::print(stderr, "{}\n", ToString(status.error()));
      return 1;
    }
  }
  return 0;
}
