// The main job on the simulated station: capture, reconstruct, score against the truth.
#include <fmt/format.h>

#include <chrono>

#include "drivers/base/staged_folder.h"
#include "drivers/base/units.h"
#include "firmware-host/cli/commands.h"
#include "firmware-host/cli/demo_capture.h"
#include "firmware-host/cli/figures.h"
#include "firmware-host/cli/truth.h"
#include "reconstruction/pipeline/pipeline.h"
#include "reconstruction/specimens/specimen.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

struct DemoOptions {
  fs::path out = "out/demo";
  std::string specimen = "beetle";
  std::string errors = "static";
  std::string method = "joint";
  bool force = false;
};

struct DemoScore {
  Spread centre_mm, rotation_deg, surface_px;
};

Result<DemoScore> ScoreDemo(const DemoPaths& paths, const std::string& specimen_name,
                            const ReconstructResult& result) {
  SCAN_TRY(const auto truth, ReadTruth(paths.truth, paths.session, result.photos));
  SCAN_TRY(const auto specimen, MakeSpecimen(specimen_name));
  const TriangleMesh exact = ExactSurface(*specimen, 0.3);
  std::vector<double> centres, rotations, surfaces;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const ViewPose& view = result.poses.views[i];
    if (view.status != ViewStatus::accepted) continue;
    const Intrinsics& intrinsics =
        IntrinsicsOf(result.poses, view, result.photos.intrinsics(result.photos.photos[i]));
    const PoseError error = ScorePose(exact, truth[i], {view.camera_from_model, intrinsics});
    centres.push_back(error.centre_mm);
    rotations.push_back(DegFromRad(error.rotation_rad));
    surfaces.push_back(error.surface_median_px);
  }
  return DemoScore{SpreadOf(centres), SpreadOf(rotations), SpreadOf(surfaces)};
}

CommandOutput MakeOutput(const DemoPaths& paths, const ReconstructResult& result,
                         const DemoScore& score, const std::vector<StageSeconds>& stages) {
  Json seconds = Json::object();
  std::string times;
  double total = 0;
  for (const StageSeconds& s : stages) {
    seconds[s.stage] = s.seconds;
    total += s.seconds;
    times += fmt::format("  {:<12} {:6.1f} s\n", s.stage, s.seconds);
  }
  seconds["total"] = total;
  CommandOutput output;
  output.json = {{"views", result.poses.views.size()},
                 {"views_accepted", result.views_accepted},
                 {"centre_error_mm", ToJson(score.centre_mm)},
                 {"rotation_error_deg", ToJson(score.rotation_deg)},
                 {"surface_error_px", ToJson(score.surface_px)},
                 {"coverage", result.coverage},
                 {"seconds", seconds},
                 {"session", paths.session.string()},
                 {"model", result.model.string()},
                 {"report", result.report.string()},
                 {"log", paths.log.string()}};
  output.text = fmt::format(
      "views accepted     {} of {}\n"
      "                     median      p95      max\n"
      "camera centre    {:10.3f} {:8.3f} {:8.3f}  mm from the truth\n"
      "camera rotation  {:10.4f} {:8.4f} {:8.4f}  deg\n"
      "surface          {:10.3f} {:8.3f} {:8.3f}  px of the full-size photograph\n"
      "texture measured {:8.1f} % of the surface\n"
      "time\n{}  {:<12} {:6.1f} s\n"
      "session  {}\nmodel    {}\nreport   {}\nlog      {}\n",
      result.views_accepted, result.poses.views.size(), score.centre_mm.median, score.centre_mm.p95,
      score.centre_mm.max, score.rotation_deg.median, score.rotation_deg.p95,
      score.rotation_deg.max, score.surface_px.median, score.surface_px.p95, score.surface_px.max,
      100 * result.coverage, times, "total", total, paths.session.string(), result.model.string(),
      result.report.string(), paths.log.string());
  return output;
}

Result<CommandOutput> RunDemo(const DemoOptions& options, const CliContext& context) {
  ReconstructRequest request;
  if (options.method == "paper") request.options.method = PoseMethod::paper;
  SCAN_TRY(StagedFolder staged, StagedFolder::Create(options.out, options.force));
  DemoPaths paths = DemoPathsIn(staged.path());
  std::vector<StageSeconds> stages;
  auto start = std::chrono::steady_clock::now();
  const auto lap = [&](const std::string& stage) {
    stages.push_back({stage, SecondsSince(start)});
    start = std::chrono::steady_clock::now();
  };

  SCAN_CHECK(CaptureDemo(paths, options.specimen, options.errors, context));
  lap("capture");
  SCAN_CHECK(MakeDemoCt(paths, options.specimen));
  lap("CT volume");
  request.session = paths.session;
  request.volume = paths.volume;
  request.out = paths.model;
  SCAN_TRY(ReconstructResult result, Reconstruct(request, context.progress, context.stop));
  stages.insert(stages.end(), result.stages.begin(), result.stages.end());
  start = std::chrono::steady_clock::now();
  SCAN_TRY(const DemoScore score, ScoreDemo(paths, options.specimen, result));
  lap("score");

  SCAN_CHECK(staged.Commit());
  paths = DemoPathsIn(staged.target());
  result.model = paths.model / "model.glb";
  result.report = paths.model / "report.html";
  return MakeOutput(paths, result, score, stages);
}

}  // namespace

void AddDemo(CommandSet& commands) {
  auto options = std::make_shared<DemoOptions>();
  CLI::App& command = commands.Add(
      "demo", "Capture a synthetic specimen on the simulated station and make its model",
      [options](const CliContext& context) { return RunDemo(*options, context); });
  command.add_option("--out", options->out, "folder to write")->capture_default_str();
  command.add_option("--specimen", options->specimen)
      ->check(CLI::IsMember(SpecimenNames()))
      ->capture_default_str();
  command.add_option("--errors", options->errors, "of the simulated rig")
      ->check(CLI::IsMember({"ideal", "static", "dynamic"}))
      ->capture_default_str();
  command.add_option("--method", options->method, "of finding the poses")
      ->check(CLI::IsMember({"joint", "paper"}))
      ->capture_default_str();
  command.add_flag("--force", options->force, "replace the folder");
}

}  // namespace scan
