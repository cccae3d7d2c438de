// How long the joint solve takes, and how much memory: photographs of 3696 x 2448 against a fine
// mesh.
#include <fmt/format.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <fstream>
#include <string>

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
  int views = 25;
  int width = 3696;
  double edge_mm = 0.065;  // of the beetle: 500 thousand faces
};

double Seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double ProcessorSeconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

// The kernel's figure for the peak since the last ForgetPeak.
double PeakMib() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024;
  return 0;
}
void ForgetPeak() { std::ofstream("/proc/self/clear_refs") << 5; }

PoseTrial MakeTrial(const SpeedOptions& options) {
  const auto specimen = MakeSpecimen(options.specimen).value();
  PoseTrial trial;
  trial.mesh = ExactSurface(*specimen, options.edge_mm);
  test::SceneOptions scene_options;
  scene_options.w = 462;  // its masks are not used
  scene_options.h = 306;
  scene_options.views = options.views;
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

void Measure(const PoseTrial& trial, bool no_priors, const char* name) {
  JointOptions joint;
  joint.no_priors = no_priors;
  ForgetPeak();
  const double start = Seconds(), processor = ProcessorSeconds();
  const auto poses = SolveJoint(trial.mesh, trial.photos, trial.masks, joint);
  const double seconds = Seconds() - start, used = ProcessorSeconds() - processor;
  const double peak = PeakMib();
  if (!poses) {
    fmt::print("{}: {}\n", name, ToString(poses.error()));
    return;
  }
  const MethodSummary s = Summarise(ScorePoses(trial, *poses, poses->free_directions), 5);
  fmt::print(
      "{:<14} {:6.2f} s  ({:6.2f} s of processor)  peak {:5.0f} MiB  accepted {} of {}  "
      "surface {:.3f} px median, {:.3f} max\n",
      name, seconds, used, peak, s.accepted, s.views, s.surface_px.median, s.surface_px.max);
}

// One outline, this way and by the depth and id buffers of the renderer.
void MeasureOutline(const PoseTrial& trial) {
  constexpr int kRounds = 10;
  double start = Seconds();
  const ContourMesh mesh(trial.mesh);
  fmt::print("mesh prepared in {:.2f} s\n", Seconds() - start);
  const auto views = std::min<std::size_t>(trial.truth.size(), kRounds);
  double quick = 0, plain = 0;
  std::size_t samples = 0, segments = 0;
  for (std::size_t i = 0; i < views; ++i) {
    const PoseOf& view = trial.truth[i];
    start = Seconds();
    samples += FindContourSamples(mesh, view.camera_from_model, view.intrinsics, 4).size();
    quick += Seconds() - start;
    start = Seconds();
    const Raster raster = Rasterise(trial.mesh, view.camera_from_model, view.intrinsics);
    segments +=
        ContourGenerators(trial.mesh, mesh.edges, view.camera_from_model, view.intrinsics, raster)
            .size();
    plain += Seconds() - start;
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
  app.add_option("--views", options.views)->check(CLI::Range(2, 1000))->capture_default_str();
  app.add_option("--width", options.width, "of the photographs, px")
      ->check(CLI::Range(200, 8000))
      ->capture_default_str();
  app.add_option("--edge-mm", options.edge_mm, "of the mesh")
      ->check(CLI::Range(0.05, 5.0))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const scan::PoseTrial trial = scan::MakeTrial(options);
  fmt::print("{}: {} photographs of {} x {}, mesh of {} faces\n", options.specimen,
             trial.masks.size(), trial.masks.front().coverage.cols,
             trial.masks.front().coverage.rows, trial.mesh.faces.size());
  scan::MeasureOutline(trial);
  scan::Measure(trial, false, "logged poses");
  scan::Measure(trial, true, "no poses");
}
