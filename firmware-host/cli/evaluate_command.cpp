// Poses against a known truth: synthetic specimens, captures of the simulated station, calibrated
// cameras.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>

#include "drivers/base/staged_folder.h"
#include "drivers/base/units.h"
#include "drivers/station/station_file.h"
#include "firmware-host/cli/commands.h"
#include "firmware-host/cli/demo_capture.h"
#include "firmware-host/cli/evaluate_model.h"
#include "firmware-host/cli/evaluate_sweep.h"
#include "firmware-host/cli/figures.h"
#include "firmware-host/cli/truth.h"
#include "reconstruction/evaluate/fig12.h"
#include "reconstruction/evaluate/pose_trial.h"
#include "reconstruction/evaluate/turntable_trial.h"
#include "reconstruction/fiducials/find_bead_images.h"
#include "reconstruction/masks/make_masks.h"
#include "reconstruction/pipeline/pipeline.h"
#include "reconstruction/specimens/specimen.h"
#include "reconstruction/surface/decimate.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

struct EvaluateOptions {
  std::string what;
  std::string preset = "demo";
  std::string specimen = "beetle";
  std::string errors = "static";
  std::string method = "both";
  std::size_t views = 0;  // 0: the preset's
  int width = 0;          // of the photographs; 0: the preset's
  bool full_size = false;
  Fig12Options fig12;  // its noise and seed are those of drawn masks, too
  double focal_error_percent = 0, logged_sigma_deg = 0, logged_sigma_mm = 0;
  double surface_off_mm = 0;
  double wrong_px = 5;
  std::size_t paper_faces = 12000;
  bool per_view = false;
  bool beads = false;
  std::string sweep;  // empty: none
  fs::path plot;
  fs::path out, from;
  bool force = false;
  EvaluateModelOptions model;
  PaperOptions paper;
  JointOptions joint;
  AppearanceOptions appearance;

  std::string specimen_name() const { return specimen + (beads ? "+beads" : ""); }
  bool is_fig12() const { return preset == "fig12"; }
  bool was_captured() const { return !is_fig12() && !from.empty(); }
  // 0: as captured.
  int photo_width() const { return full_size ? 3696 : width > 0 || !is_fig12() ? width : 462; }
  bool draws_masks() const {
    return is_fig12() || photo_width() > 0 || fig12.noise.displaces() || fig12.noise.binary;
  }
  bool with_joint() const { return method != "paper"; }
  bool with_paper() const { return method != "joint"; }
};

Json ToJson(const PoseError& error) {
  return {{"centre_mm", error.centre_mm},
          {"rotation_deg", DegFromRad(error.rotation_rad)},
          {"surface_rms_px", error.surface_rms_px},
          {"surface_median_px", error.surface_median_px}};
}

Json ToJson(const MethodFigures& figures, double wrong_px) {
  const MethodSummary s = Summarise(figures, wrong_px);
  Json free = Json::array();
  for (const FreeDirection& f : figures.free_directions)
    free.push_back({{"kind", f.kind == FreeDirection::Kind::rotation ? "rotation" : "translation"},
                    {"of", f.of},
                    {"axis", {f.axis.x(), f.axis.y(), f.axis.z()}}});
  Json views = Json::array();
  for (const ViewFigures& v : figures.views)
    views.push_back({{"name", v.name},
                     {"accepted", v.accepted},
                     {"reason", v.reason},
                     {"cost_px", v.cost_px},
                     {"cost_l1_px", v.cost_l1_px},
                     {"nees", v.nees},
                     {"centre_sigma_mm", v.centre_sigma_mm},
                     {"error", ToJson(v.error)},
                     {"error_up_to_free_turn", ToJson(v.turned)}});
  return {{"views", s.views},
          {"accepted", s.accepted},
          {"accepted_wrong", s.wrong},
          {"wrong_px", wrong_px},
          {"surface_rms_px", ToJson(s.surface_px)},
          {"centre_mm", ToJson(s.centre_mm)},
          {"rotation_deg", ToJson(s.rotation_deg)},
          {"cost_px", ToJson(s.cost_px)},
          {"centre_as_found_mm", ToJson(s.centre_raw_mm)},
          {"surface_as_found_px", ToJson(s.surface_raw_px)},
          {"mean_nees", s.mean_nees},
          {"centre_rms_mm", s.centre_rms_mm},
          {"centre_rms_per_reported_sigma", s.centre_per_sigma},
          {"seconds", figures.seconds},
          {"free_directions", free},
          {"per_view", views}};
}

// A folder of its own that is removed at the end.
class ScratchFolder {
 public:
  static Result<std::unique_ptr<ScratchFolder>> Create() {
    std::error_code code;
    std::string pattern = (fs::temp_directory_path(code) / "scanstation-XXXXXX").string();
    if (code || !::mkdtemp(pattern.data()))
      return Failed("no folder for the capture can be made", pattern,
                    "set TMPDIR to a folder that can be written, or give --out");
    return std::unique_ptr<ScratchFolder>(new ScratchFolder(pattern));
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  explicit ScratchFolder(fs::path path) : path_(std::move(path)) {}
  fs::path path_;
};

// Photographs with known cameras, and what else colour needs of them.
struct Capture {
  PoseTrial trial;
  std::optional<Volume> volume;
  BeadFindings beads;
  std::shared_ptr<const ScratchFolder> scratch;  // where the photographs lie, if nobody keeps them
};

struct Evaluation {
  std::vector<MethodFigures> methods;
  Json turns = Json::array();  // free by the silhouettes: what colour made of them
  std::string text;
};

// What of each turn that the silhouettes left free is wrong after colour had its say.
void DescribeTurns(const PoseTrial& trial, const Poses& poses, std::span<const FreeDirection> free,
                   Evaluation& evaluation) {
  for (const FreeDirection& turn : free) {
    if (turn.kind != FreeDirection::Kind::rotation) continue;
    const std::vector<double> errors = TurnErrors(trial, poses, turn);
    if (errors.empty()) continue;
    double largest = 0, spread = 0;
    for (const double error : errors) {
      largest = std::max(largest, std::abs(error));
      spread = std::max(spread, std::abs(std::remainder(error - errors.front(), 2 * kPi)));
    }
    const bool decided = poses.free_directions.size() < free.size();
    evaluation.turns.push_back({{"of", turn.of},
                                {"decided_by_colour", decided},
                                {"largest_error_deg", DegFromRad(largest)},
                                {"largest_between_views_deg", DegFromRad(spread)}});
    evaluation.text += fmt::format(
        "turn about the free axis of {}: {}; largest error {:.2f} deg, between views {:.2f} deg\n",
        turn.of, decided ? "decided by colour" : "not decided, arbitrary", DegFromRad(largest),
        DegFromRad(spread));
  }
}

// The joint solve, and by colour the turns that it leaves free. `free`: those.
Result<Poses> SolveAll(const Capture& capture, const EvaluateOptions& options,
                       const CliContext& context, std::vector<FreeDirection>& free) {
  const PoseTrial& trial = capture.trial;
  JointOptions joint = options.joint;
  joint.bead_findings = capture.beads;
  SCAN_TRY(Poses poses, SolveJoint(trial.mesh, trial.photos, trial.masks, joint, context.progress,
                                   context.stop));
  free = poses.free_directions;
  // There are no photographs of another size.
  if (options.photo_width() > 0) return poses;
  SCAN_CHECK(DecideFreeTurns(trial.mesh, capture.volume ? &*capture.volume : nullptr, trial.photos,
                             trial.masks, options.appearance, poses, context.progress,
                             context.stop));
  return poses;
}

// Joint first: what it leaves free is taken off for both.
Result<Evaluation> RunMethods(const Capture& capture, const EvaluateOptions& options,
                              const CliContext& context) {
  const PoseTrial& trial = capture.trial;
  Evaluation evaluation;
  std::vector<FreeDirection> free;
  const auto score = [&](const Poses& poses, std::span<const FreeDirection> taken_off,
                         double seconds) {
    evaluation.methods.push_back(ScorePoses(trial, poses, taken_off));
    evaluation.methods.back().seconds = seconds;
  };
  auto start = std::chrono::steady_clock::now();
  if (options.with_joint()) {
    SCAN_TRY(const Poses poses, options.is_fig12() ? SolveEachAlone(trial, options.joint,
                                                                    context.progress, context.stop)
                                                   : SolveAll(capture, options, context, free));
    score(poses, poses.free_directions, SecondsSince(start));
    if (options.is_fig12()) free = poses.free_directions;
    if (!options.is_fig12()) DescribeTurns(trial, poses, free, evaluation);
  }
  start = std::chrono::steady_clock::now();
  if (options.with_paper()) {
    TriangleMesh mesh = trial.mesh;
    if (options.paper_faces > 0) {
      SCAN_TRY(Decimation fewer, Decimate(mesh, {.faces = options.paper_faces}));
      mesh = std::move(fewer.mesh);
    }
    SCAN_TRY(const Poses poses, SolvePaper(mesh, trial.photos, trial.masks, options.paper,
                                           context.progress, context.stop));
    score(poses, free, SecondsSince(start));
  }
  return evaluation;
}

// A folder that `scanstation demo` or `evaluate poses --out` wrote, its truth beside the session.
Result<Capture> CaptureIn(const DemoPaths& paths, const EvaluateOptions& options,
                          const CliContext& context) {
  Capture capture;
  PoseTrial& trial = capture.trial;
  SCAN_TRY(trial.photos, LoadPhotoSet(paths.session));
  SCAN_TRY(trial.truth, ReadTruth(paths.truth, paths.session, trial.photos));
  const auto indices =
      EvenlySpread(trial.photos.photos.size(), options.views > 0 ? options.views : 24);
  trial.masks.resize(trial.photos.photos.size());
  trial = Subset(trial, indices);
  SCAN_TRY(const auto specimen, MakeSpecimen(options.specimen_name()));
  trial.surface = ExactSurface(*specimen, 0.3);
  TurntableErrors errors;
  errors.w = options.photo_width();
  errors.focal_error_rel = options.focal_error_percent / 100;
  errors.turntable_sigma_rad = RadFromDeg(options.logged_sigma_deg);
  errors.lift_sigma_mm = options.logged_sigma_mm;
  StateErrors(trial, errors);
  if (options.draws_masks()) {
    DrawMasks(trial, {.noise = options.fig12.noise, .seed = options.fig12.seed});
  } else {
    SCAN_TRY(trial.masks, MakeMasks(trial.photos, {}, context.progress, context.stop));
  }
  SCAN_TRY(capture.volume, ReadVolume(paths.volume, {}));
  SCAN_TRY(SurfaceResult surface,
           ExtractSurface(*capture.volume, {}, context.progress, context.stop));
  trial.mesh = std::move(surface.mesh);
  if (options.surface_off_mm != 0) OffsetMesh(trial, options.surface_off_mm);
  if (options.beads) {
    FiducialOptions fiducials;
    fiducials.bead_mm = 1.0;
    SCAN_TRY(fiducials.bead_colour, ParseBeadColour("#0060ff"));
    SCAN_TRY(capture.beads, FindFiducials(fiducials, &*capture.volume, trial.photos,
                                          context.progress, context.stop));
  }
  return capture;
}

Status CaptureInto(const fs::path& folder, const EvaluateOptions& options,
                   const CliContext& context) {
  const DemoPaths paths = DemoPathsIn(folder);
  SCAN_CHECK(CaptureDemo(paths, options.specimen_name(), options.errors, context));
  return MakeDemoCt(paths, options.specimen_name());
}

// The paper renders its photographs from the mesh that it then searches; so does this (but for
// --paper-faces).
Result<PoseTrial> Fig12Trial(const EvaluateOptions& options) {
  SCAN_TRY(const auto specimen, MakeSpecimen(options.specimen));
  Fig12Options fig12 = options.fig12;
  if (options.views > 0) fig12.cameras = static_cast<int>(options.views);
  fig12.w = options.photo_width();
  fig12.h = static_cast<int>(std::lround(fig12.w * 2448.0 / 3696));
  return MakeFig12Trial(ExactSurface(*specimen, 0.35), fig12);
}

Result<Capture> MakeCapture(const EvaluateOptions& options, const CliContext& context) {
  if (options.is_fig12()) {
    SCAN_TRY(PoseTrial trial, Fig12Trial(options));
    StateErrors(trial, {.focal_error_rel = options.focal_error_percent / 100});
    if (options.surface_off_mm != 0) OffsetMesh(trial, options.surface_off_mm);
    return Capture{std::move(trial), {}, {}, {}};
  }
  if (options.was_captured()) return CaptureIn(DemoPathsIn(options.from), options, context);
  if (options.out.empty()) {
    SCAN_TRY(std::shared_ptr<const ScratchFolder> scratch, ScratchFolder::Create());
    SCAN_CHECK(CaptureInto(scratch->path(), options, context));
    SCAN_TRY(Capture capture, CaptureIn(DemoPathsIn(scratch->path()), options, context));
    capture.scratch = scratch;
    return capture;
  }
  SCAN_TRY(StagedFolder staged, StagedFolder::Create(options.out, options.force));
  SCAN_CHECK(CaptureInto(staged.path(), options, context));
  SCAN_CHECK(staged.Commit());
  return CaptureIn(DemoPathsIn(staged.target()), options, context);
}

// The bars of the protocol.
std::string WithinText(const MethodFigures& figures) {
  return fmt::format("{}: within 5 mm and 1 deg {}, within 15 mm and 1.5 deg {} of {}\n",
                     figures.method, CountWithin(figures, 5, 1), CountWithin(figures, 15, 1.5),
                     figures.views.size());
}

std::string ProtocolText(const EvaluateOptions& options, const PoseTrial& trial) {
  const Intrinsics& in = trial.photos.intrinsics(trial.photos.photos.front());
  const std::string where =
      options.is_fig12()     ? fmt::format("Fig 12 protocol, f = {:g} mm", options.fig12.focal_mm)
      : options.from.empty() ? fmt::format("simulated station, {} errors", options.errors)
                             : "simulated station, captured before";
  std::string text = fmt::format("{}: {} photographs of {} x {}, {}\n", options.specimen,
                                 trial.photos.photos.size(), in.w, in.h, where);
  const ContourNoise& noise = options.fig12.noise;
  if (noise.displaces() || noise.binary)
    text += fmt::format("outlines stray by {:g} px (correlation {:g} px), swell by {:g} px{}\n",
                        noise.sigma_px, noise.correlation_px, noise.bias_px,
                        noise.binary ? ", binary masks" : "");
  if (!options.is_fig12() && options.draws_masks())
    text += "masks drawn from the exact surface at the true cameras\n";
  if (options.focal_error_percent != 0)
    text += fmt::format("stated focal length off by {:g} %\n", options.focal_error_percent);
  if (options.surface_off_mm != 0)
    text += fmt::format("mesh outside of the surface by {:g} mm\n", options.surface_off_mm);
  if (options.with_paper())
    text += fmt::format(
        "paper: {} directions x {} distances x {} angles, {} chains x {} steps, gate {}, mesh of "
        "{}\n",
        10 * (1 << (2 * options.paper.subdivisions)) + 2, options.paper.distance_offsets_mm.size(),
        360 / options.paper.angle_step_deg, options.paper.chains, options.paper.hill_steps,
        options.paper.gate_px,
        options.paper_faces > 0 ? fmt::format("{} faces", options.paper_faces) : "all faces");
  return text;
}

// Small and few where nothing else is asked for: a sweep solves many times.
Result<CommandOutput> Sweep(EvaluateOptions& options, const CliContext& context) {
  if (options.is_fig12())
    return BadInput("the protocol of Fig 12 has no logged poses to sweep", "--sweep",
                    "leave out --preset fig12");
  if (options.views == 0) options.views = 8;
  if (options.photo_width() == 0) options.width = 924;
  SCAN_TRY(const Capture capture, MakeCapture(options, context));
  SweepOptions sweep;
  sweep.masks = {.noise = options.fig12.noise, .seed = options.fig12.seed};
  sweep.joint = options.joint;
  sweep.wrong_px = options.wrong_px;
  SCAN_TRY(CommandOutput output,
           RunSweep(capture.trial, options.sweep == "noise" ? SweepOf::noise : SweepOf::prior,
                    sweep, options.plot, context));
  options.method = "joint";
  output.text = ProtocolText(options, capture.trial) + output.text;
  output.json["specimen"] = options.specimen;
  output.json["width"] = options.photo_width();
  return output;
}

Result<CommandOutput> RunEvaluate(EvaluateOptions& options, const CliContext& context) {
  if (options.what != "poses") {
    options.model.model = options.what;
    return EvaluateModel(options.model, context);
  }
  if (options.is_fig12() && options.beads)
    return BadInput("the protocol of Fig 12 has no beads", "--beads", "leave out --preset fig12");
  if (options.is_fig12()) {
    // Exact masks of an exact mesh: no bias is looked for.
    if (options.fig12.noise.bias_px == 0 && options.surface_off_mm == 0)
      options.joint.rig.mask_bias_px = 0.02 * 1848 / options.photo_width();
    // The mesh is the truth: residuals hang together as far as the masks' errors do, and no more.
    constexpr double kLeastCorrelationPx = 2;
    if (options.fig12.noise.sigma_px > 0)
      options.joint.refine.correlation_floor_px =
          kLeastCorrelationPx * 1848 / options.photo_width();
  }
  if (options.was_captured()) {
    SCAN_TRY(const StationConfig station, LoadStationConfig(DemoPathsIn(options.from).config));
    options.specimen = station.sim.specimen;
    options.beads = options.specimen.ends_with("+beads");
    if (options.beads) options.specimen.resize(options.specimen.rfind("+beads"));
  }
  if (!options.sweep.empty()) return Sweep(options, context);
  SCAN_TRY(const Capture capture, MakeCapture(options, context));
  const PoseTrial& trial = capture.trial;
  SCAN_TRY(const Evaluation evaluation, RunMethods(capture, options, context));
  const std::vector<MethodFigures>& methods = evaluation.methods;
  Json by_method = Json::object();
  for (const MethodFigures& method : methods)
    by_method[method.method] = ToJson(method, options.wrong_px);
  std::string text = ProtocolText(options, trial);
  text += TableOf(methods, options.wrong_px, options.per_view) + evaluation.text;
  if (options.is_fig12())
    for (const MethodFigures& method : methods) text += WithinText(method);
  return CommandOutput{
      {{"specimen", options.specimen},
       {"preset", options.preset},
       {"errors", options.is_fig12() || options.was_captured() ? Json() : Json(options.errors)},
       {"width", trial.photos.intrinsics(trial.photos.photos.front()).w},
       {"focal_mm", options.is_fig12() ? Json(options.fig12.focal_mm) : Json()},
       {"photographs", trial.photos.photos.size()},
       {"turns_left_free_by_silhouettes", evaluation.turns},
       {"methods", by_method}},
      text};
}

// What is told to the solvers beside what is true.
void AddStatedErrors(CLI::App& command, EvaluateOptions& options) {
  command
      .add_option("--focal-error-percent", options.focal_error_percent,
                  "the stated focal length is longer by this; its sigma grows by as much")
      ->check(CLI::Range(-50.0, 50.0))
      ->capture_default_str();
  command
      .add_option("--surface-off-mm", options.surface_off_mm,
                  "the mesh lies outside of the surface by this: a CT threshold too low")
      ->check(CLI::Range(-5.0, 5.0))
      ->capture_default_str();
  command
      .add_option("--logged-sigma-deg", options.logged_sigma_deg,
                  "demo: stated sigma of each turntable angle; as logged if not given")
      ->check(CLI::Range(0.0, 180.0));
  command
      .add_option("--logged-sigma-mm", options.logged_sigma_mm,
                  "demo: stated sigma of each lift height; as logged if not given")
      ->check(CLI::Range(0.0, 100.0));
}

void AddSweep(CLI::App& command, EvaluateOptions& options) {
  CLI::Option* sweep =
      command
          .add_option("--sweep", options.sweep,
                      "demo: joint with the logged poses and without, for outlines that stray ever "
                      "more (noise) or logged poses that are ever farther off (prior); 8 views, "
                      "924 px wide if not given")
          ->check(CLI::IsMember({"noise", "prior"}));
  command.add_option("--plot", options.plot, "of a sweep: PNG to write")->needs(sweep);
}

}  // namespace

void AddEvaluate(CommandSet& commands) {
  auto options = std::make_shared<EvaluateOptions>();
  CLI::App& command =
      commands.Add("evaluate", "Poses against a known truth",
                   [options](const CliContext& context) { return RunEvaluate(*options, context); });
  command
      .add_option("what", options->what,
                  "poses: capture a synthetic specimen and solve it; or the folder of a model, "
                  "compared with --truth")
      ->required();
  command.add_option("--truth", options->model.truth,
                     "of a model: calibrated cameras (fx fy cx cy w h views)");
  command.add_option("--session", options->model.session, "of a model: its photographs");
  command.add_option("--mesh", options->model.mesh,
                     "of a model: its mesh; surface.ply if not given");
  command.add_option("--exclude-below-mm", options->model.exclude_below_mm,
                     "of a model: as given when it was made");
  command.add_option("--specimen", options->specimen)
      ->check(CLI::IsMember(SpecimenNames()))
      ->capture_default_str();
  command
      .add_option(
          "--preset", options->preset,
          "demo: captured on the simulated station; fig12: the paper's random cameras, each "
          "photograph alone")
      ->check(CLI::IsMember({"demo", "fig12"}))
      ->capture_default_str();
  command.add_option("--focal-mm", options->fig12.focal_mm, "fig12: of a sensor 23.6 mm wide")
      ->check(CLI::Range(10.0, 1000.0))
      ->capture_default_str();
  command
      .add_option(
          "--width", options->width,
          "of the photographs, px; fig12: 462 if not given. Captured ones: masks drawn from "
          "the exact surface at the true cameras take their place, as with every error of "
          "the outlines")
      ->check(CLI::Range(120, 8000));
  command.add_flag("--full-size", options->full_size, "3696 x 2448")->excludes("--width");
  ContourNoise& noise = options->fig12.noise;
  command.add_option("--noise-px", noise.sigma_px, "sigma by which the outlines stray")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  command
      .add_option("--noise-length-px", noise.correlation_px,
                  "integral of the noise's autocorrelation along the outline")
      ->check(CLI::Range(0.5, 1000.0))
      ->capture_default_str();
  command.add_option("--bias-px", noise.bias_px, "by which the masks swell")
      ->check(CLI::Range(-100.0, 100.0))
      ->capture_default_str();
  command.add_flag("--binary", noise.binary, "masks of whole pixels");
  command
      .add_option("--seed", options->fig12.seed,
                  "of the outlines' errors; fig12: of the cameras, too")
      ->capture_default_str();
  command
      .add_flag("--beads", options->beads,
                "demo: three blue beads of 1 mm half sunk into the specimen, used by joint")
      ->excludes("--width")
      ->excludes("--full-size");
  AddStatedErrors(command, *options);
  AddSweep(command, *options);
  command.add_option("--errors", options->errors, "of the simulated rig")
      ->check(CLI::IsMember({"ideal", "static", "dynamic"}))
      ->capture_default_str();
  command.add_option("--method", options->method, "on the same photographs")
      ->check(CLI::IsMember({"joint", "paper", "both"}))
      ->capture_default_str();
  command
      .add_option(
          "--views", options->views,
          "photographs: of the 24 captured, evenly spread; fig12: cameras, 100 if not given")
      ->check(CLI::Range(1, 1000));
  command.add_option("--wrong-px", options->wrong_px, "surface error that makes a pose wrong")
      ->check(Positive())
      ->capture_default_str();
  command.add_option("--chains", options->paper.chains, "of the paper's hill climbing")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command.add_option("--hill-steps", options->paper.hill_steps, "of each chain")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command
      .add_option("--paper-faces", options->paper_faces,
                  "the paper's method gets the mesh decimated to this, for its thousands of "
                  "pictures; 0: as it is")
      ->check(CLI::Range(0, 100'000'000))
      ->capture_default_str();
  command.add_flag("!--no-appearance", options->appearance.enabled,
                   "demo: colour decides no turn that the silhouettes leave free");
  command.add_flag("--per-view", options->per_view, "one line a view");
  CLI::Option* out =
      command.add_option("--out", options->out, "keep session, truth and CT volume in this folder");
  command
      .add_option("--from", options->from,
                  "demo: a folder that --out made, with its specimen, instead of a new capture")
      ->excludes(out);
  command.add_flag("--force", options->force, "replace the folder");
}

}  // namespace scan
