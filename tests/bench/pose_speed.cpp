// How long the joint solve takes, and how much memory: photographs of 3696 x 2448 against a fine
// mesh.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <string>

#include "clocks.h"
#include "pose_scene.h"
#include "reconstruction/evaluate/turntable_trial.h"
#include "reconstruction/pose/contour_sample.h"
#include "reconstruction/render/contour_generators.h"
#include "reconstruction/render/rasterise.h"
#include "reconstruction/specimens/specimen.h"

namespace scan {
namespace {

struct SpeedOptions {
  std::string specimen = "beetle";
  std::vector<int> views{25};
  int width = 3696;
  double edge_mm = 0.065;  // of the beetle: 500 thousand faces
};

// The kernel's figure for the peak since the last ForgetPeak.
double PeakMib() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024;
  return 0;
}
void ForgetPeak() { std::ofstream("/proc/self/clear_refs") << 5; }

PoseTrial MakeTrial(const SpeedOptions& options, int views) {
  const auto specimen = MakeSpecimen(options.specimen).value();
  PoseTrial trial;
  trial.mesh = ExactSurface(*specimen, options.edge_mm);
  test::SceneOptions scene_options;
  scene_options.w = 462;  // its masks are not used
  scene_options.h = 306;
  scene_options.views = views;
  scene_options.static_errors = true;
  const TableFromModel placing(ExpSo3({0.02, -0.03, 0.7}), Eigen::Vector3d(0.5, -1, 14));
  const test::Scene scene = test::MakeScene(ExactSurface(*specimen, 1), placing, scene_options);
  trial.photos = scene.photos;
  for (std::size_t i = 0; i < scene.truth.size(); ++i)
    trial.truth.push_back({scene.truth[i], scene.true_intrinsics[i]});
  StateErrors(trial, {.w = options.width});
  trial.surface = trial.mesh;
  DrawMasks(trial, {.noise = {.sigma_px = 0.3}});
  return trial;
}

// Returns the seconds of processor.
double Measure(const PoseTrial& trial, bool no_priors, const char* name) {
  JointOptions joint;
  joint.no_priors = no_priors;
  ForgetPeak();
  const double start = bench::Seconds(), processor = bench::ProcessorSeconds(),
               stolen = bench::StolenSeconds();
  const auto poses = SolveJoint(trial.mesh, trial.photos, trial.masks, joint);
  const double seconds = bench::Seconds() - start, used = bench::ProcessorSeconds() - processor,
               taken = bench::StolenSeconds() - stolen;
  const double peak = PeakMib();
  if (!poses) {
    fmt::print("{}: {}\n", name, ToString(poses.error()));
    return used;
  }
  const MethodSummary s = Summarise(ScorePoses(trial, *poses, poses->free_directions), 5);
  fmt::print(
      "{:<14} {:6.2f} s  ({:6.2f} s of processor, {:.2f} s taken by the host)  peak {:5.0f} MiB  "
      "accepted {} of {}  surface {:.3f} px median, {:.3f} max\n",
      name, seconds, used, taken, peak, s.accepted, s.views, s.surface_px.median, s.surface_px.max);
  return used;
}

// One outline, this way and by the depth and id buffers of the renderer.
void MeasureOutline(const PoseTrial& trial) {
  constexpr int kRounds = 10;
  double start = bench::Seconds(), processor = bench::ProcessorSeconds();
  const ContourMesh mesh(trial.mesh);
  const ViewSearch templates(mesh, trial.photos.approx_distance_mm.value_or(0), {}, {});
  fmt::print("mesh and templates of all views prepared in {:.2f} s ({:.2f} s of processor)\n",
             bench::Seconds() - start, bench::ProcessorSeconds() - processor);
  const auto views = std::min<std::size_t>(trial.truth.size(), kRounds);
  double quick = 0, plain = 0;
  std::size_t samples = 0, segments = 0;
  for (std::size_t i = 0; i < views; ++i) {
    const PoseOf& view = trial.truth[i];
    start = bench::Seconds();
    samples += FindContourSamples(mesh, view.camera_from_model, view.intrinsics, 4).size();
    quick += bench::Seconds() - start;
    start = bench::Seconds();
    const Raster raster = Rasterise(trial.mesh, view.camera_from_model, view.intrinsics);
    segments +=
        ContourGenerators(trial.mesh, mesh.edges, view.camera_from_model, view.intrinsics, raster)
            .size();
    plain += bench::Seconds() - start;
  }
  fmt::print(
      "outline of a view: {:.1f} ms on one core; by depth buffer and contour generators {:.1f} ms "
      "on all, {:.1f} x ({} samples, {} segments)\n",
      1e3 * quick / views, 1e3 * plain / views, plain / quick, samples / views, segments / views);
}

}  // namespace
}  // namespace scan

int main(int argc, char** argv) {
  scan::SpeedOptions options;
  CLI::App app("Seconds and memory of the joint solve", "bench_pose_speed");
  app.add_option("--specimen", options.specimen)
      ->check(CLI::IsMember(scan::SpecimenNames()))
      ->capture_default_str();
  app.add_option("--views", options.views, "photographs; several counts: what an added one costs")
      ->check(CLI::Range(2, 1000))
      ->capture_default_str();
  app.add_option("--width", options.width, "of the photographs, px")
      ->check(CLI::Range(200, 8000))
      ->capture_default_str();
  app.add_option("--edge-mm", options.edge_mm, "of the mesh")
      ->check(CLI::Range(0.05, 5.0))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  std::sort(options.views.begin(), options.views.end());
  int before = 0;
  double logged_before = 0, alone_before = 0;
  for (const int views : options.views) {
    const scan::PoseTrial trial = scan::MakeTrial(options, views);
    fmt::print("{}: {} photographs of {} x {}, mesh of {} faces\n", options.specimen, views,
               trial.masks.front().coverage.cols, trial.masks.front().coverage.rows,
               trial.mesh.faces.size());
    if (before == 0) scan::MeasureOutline(trial);
    const double logged = scan::Measure(trial, false, "logged poses");
    const double alone = scan::Measure(trial, true, "no poses");
    if (before > 0 && views > before)
      fmt::print("an added photograph: {:.2f} s of processor with logged poses, {:.2f} s without\n",
                 (logged - logged_before) / (views - before),
                 (alone - alone_before) / (views - before));
    before = views;
    logged_before = logged;
    alone_before = alone;
  }
}
