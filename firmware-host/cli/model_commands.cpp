// The stages of the reconstruction, alone and together.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <span>

#include "drivers/base/files.h"
#include "drivers/base/staged_folder.h"
#include "firmware-host/cli/commands.h"
#include "reconstruction/atlas/chart_picture.h"
#include "reconstruction/fiducials/find_bead_images.h"
#include "reconstruction/mesh/mesh_io.h"
#include "reconstruction/pipeline/pipeline.h"
#include "reconstruction/render/shade.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

struct ModelOptions {
  fs::path session, volume, mesh, poses, out, picture;
  bool force = false;
  std::vector<double> voxel_mm;
  double threshold = 0;
  bool has_threshold = false;
  std::string method = "joint";
  std::string unfold = "lscm";
  std::string bead_colour;
  StageOptions stages;
};

Status Resolve(ModelOptions& options) {
  StageOptions& stages = options.stages;
  if (options.voxel_mm.size() == 2)
    return BadInput("a voxel size of two values", "--voxel-mm", "give one value or X,Y,Z");
  if (options.voxel_mm.size() == 1) options.voxel_mm.resize(3, options.voxel_mm.front());
  if (!options.voxel_mm.empty())
    stages.volume.voxel_mm =
        Eigen::Vector3d(options.voxel_mm[0], options.voxel_mm[1], options.voxel_mm[2]);
  if (options.has_threshold) stages.surface.segment.threshold = options.threshold;
  if (!options.bead_colour.empty()) {
    SCAN_TRY(stages.fiducials.bead_colour, ParseBeadColour(options.bead_colour));
  }
  stages.method = options.method == "paper" ? PoseMethod::paper : PoseMethod::joint;
  stages.atlas.method = options.unfold == "arap" ? UnfoldMethod::arap : UnfoldMethod::lscm;
  return {};
}

void AddVolumeOptions(CLI::App& command, ModelOptions& options) {
  command
      .add_option("--voxel-mm", options.voxel_mm,
                  "voxel size, one value or X,Y,Z; needed where the file has none")
      ->delimiter(',')
      ->expected(1, 3)
      ->check(Positive());
  command.add_option_function<double>(
      "--threshold",
      [&options](const double& value) {
        options.threshold = value;
        options.has_threshold = true;
      },
      "grey value of the surface; automatic without it");
  command.add_option("--faces", options.stages.surface.decimate.faces, "size of the mesh")
      ->check(CLI::Range(4, 100'000'000))
      ->capture_default_str();
}

void AddAtlasOptions(CLI::App& command, ModelOptions& options) {
  command.add_option("--atlas-px", options.stages.atlas.size_px, "side of the atlas")
      ->check(CLI::Range(64, 16384))
      ->capture_default_str();
  command.add_option("--unfold", options.unfold)
      ->check(CLI::IsMember({"lscm", "arap"}))
      ->capture_default_str();
}

void AddEvidenceOptions(CLI::App& command, ModelOptions& options) {
  command.add_option("--exclude-below-mm", options.stages.exclude_below_mm,
                     "what stands lower above the platter (stub, pin, base) is no evidence");
}

void AddPoseOptions(CLI::App& command, ModelOptions& options) {
  command
      .add_option("--method", options.method,
                  "joint: all photographs with the logged poses; paper: each alone, as published")
      ->check(CLI::IsMember({"joint", "paper"}))
      ->capture_default_str();
  AddEvidenceOptions(command, options);
  command.add_flag("--no-priors", options.stages.joint.no_priors,
                   "joint: leave logged poses aside, as for photographs taken by hand");
  command.add_option("--chains", options.stages.paper.chains, "of the paper's hill climbing")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
}

void AddBeadOptions(CLI::App& command, ModelOptions& options) {
  command.add_option("--beads", options.stages.fiducials.beads,
                     "joint: beads.json that reconstruct wrote: where X-rays show the beads");
  command.add_option("--bead-colour", options.bead_colour,
                     "joint: of the beads, #rrggbb; a strong one that the specimen has not");
}

void AddOut(CLI::App& command, ModelOptions& options, const std::string& what) {
  command.add_option("--out", options.out, what)->required();
  command.add_flag("--force", options.force, "replace what is there");
}

void AddPicture(CLI::App& command, ModelOptions& options) {
  command.add_option("--picture", options.picture, "PNG file to write: the result from two sides");
}

Status PreparePicture(const ModelOptions& options) {
  return options.picture.empty() ? Status{} : PrepareOutputFile(options.picture, options.force);
}

Status WritePicture(const ModelOptions& options, const cv::Mat& picture) {
  std::vector<std::uint8_t> png;
  if (!cv::imencode(".png", picture, png, {cv::IMWRITE_PNG_COMPRESSION, 9}))
    return Failed("the picture cannot be encoded", options.picture.string(), "give another name");
  return WriteFileDurably(options.picture, std::as_bytes(std::span(png)));
}

void AddAppearanceOptions(CLI::App& command, ModelOptions& options) {
  command.add_flag(
      "!--no-appearance", options.stages.appearance.enabled,
      "leave a turn about an axis of revolution free, even where the colour of the surface that "
      "follows the CT below it would decide it");
}

Json TopologyJson(const TopologyReport& topology) {
  return {{"closed_manifold", topology.closed_manifold()},
          {"boundary_edges", topology.boundary_edges},
          {"non_manifold_edges", topology.non_manifold_edges},
          {"components", topology.components},
          {"euler", topology.euler}};
}

Result<CommandOutput> RunSurface(ModelOptions& options, const CliContext& context) {
  SCAN_CHECK(Resolve(options));
  SCAN_CHECK(PrepareOutputFile(options.out, options.force));
  SCAN_CHECK(PreparePicture(options));
  SCAN_TRY(const Volume volume, ReadVolume(options.volume, options.stages.volume));
  SCAN_TRY(const SurfaceResult surface,
           ExtractSurface(volume, options.stages.surface, context.progress, context.stop));
  SCAN_CHECK(WritePly(options.out, surface.mesh));
  if (!options.picture.empty()) SCAN_CHECK(WritePicture(options, ShadedPicture(surface.mesh, {})));
  return CommandOutput{
      {{"surface", options.out.string()},
       {"vertices", surface.mesh.vertices.size()},
       {"faces", surface.mesh.faces.size()},
       {"threshold", surface.segmentation.threshold},
       {"area_mm2", SurfaceArea(surface.mesh)},
       {"volume_mm3", SignedVolume(surface.mesh)},
       {"inner_voxels_filled", surface.segmentation.cavity_voxels},
       {"specks_dropped", surface.segmentation.small_components + surface.specks},
       {"topology", TopologyJson(surface.topology)}},
      fmt::format("{} faces, {}, threshold {:.4g}: {}\n", surface.mesh.faces.size(),
                  surface.topology.closed_manifold() ? "closed manifold" : "not a closed manifold",
                  surface.segmentation.threshold, options.out.string())};
}

Result<CommandOutput> RunAtlas(ModelOptions& options, const CliContext& context) {
  SCAN_CHECK(Resolve(options));
  SCAN_CHECK(PrepareOutputFile(options.out, options.force));
  SCAN_CHECK(PreparePicture(options));
  SCAN_TRY(const TriangleMesh mesh, ReadMesh(options.mesh));
  SCAN_TRY(const AtlasResult atlas,
           MakeAtlas(mesh, options.stages.atlas, context.progress, context.stop));
  SCAN_CHECK(WriteAtlasObj(options.out, atlas.atlas, ""));
  if (!options.picture.empty()) SCAN_CHECK(WritePicture(options, ChartPicture(atlas.atlas)));
  const AtlasReport& report = atlas.report;
  return CommandOutput{
      {{"atlas", options.out.string()},
       {"charts", report.charts},
       {"texels_per_mm", report.texels_per_mm},
       {"stretch_l2", report.stretch_l2},
       {"stretch_median", report.stretch_median},
       {"stretch_p95", report.stretch_p95},
       {"stretch_p99", report.stretch_p99},
       {"texel_usage", report.texel_usage},
       {"padding_usage", report.padding_usage},
       {"seam_length_mm", report.seam_length_mm}},
      fmt::format("{} charts, L2 stretch {:.3f}, {:.0f} % of the atlas used: {}\n", report.charts,
                  report.stretch_l2, 100 * report.texel_usage, options.out.string())};
}

Result<CommandOutput> RunMasks(ModelOptions& options, const CliContext& context) {
  SCAN_TRY(const PhotoSet photos, LoadPhotoSet(options.session));
  SCAN_TRY(const std::vector<Mask> masks,
           MakeMasks(photos, options.stages.masks, context.progress, context.stop));
  SCAN_CHECK(SaveMasks(photos, masks));
  const auto folder = photos.session / "derived" / "masks";
  return CommandOutput{{{"masks", folder.string()}, {"count", masks.size()}},
                       fmt::format("{} masks in {}\n", masks.size(), folder.string())};
}

Json PoseSummary(const Poses& poses) {
  Json views = Json::array();
  for (const ViewPose& view : poses.views)
    views.push_back({{"name", view.name},
                     {"accepted", view.status == ViewStatus::accepted},
                     {"reason", view.reason},
                     {"cost_px", view.cost_px},
                     {"contour_rms_px", view.contour_rms_px}});
  return views;
}

std::string PoseText(const Poses& poses) {
  std::string text;
  for (const ViewPose& view : poses.views)
    text += fmt::format("{:<16} {:<9} cost {:7.3f} px  contour {:7.3f} px  {}\n", view.name,
                        view.status == ViewStatus::accepted ? "accepted" : "rejected", view.cost_px,
                        view.contour_rms_px, view.reason);
  for (const std::string& note : poses.notes) text += note + "\n";
  return text;
}

Result<CommandOutput> RunPose(ModelOptions& options, const CliContext& context) {
  SCAN_CHECK(Resolve(options));
  SCAN_TRY(StagedFolder staged, StagedFolder::Create(options.out, options.force));
  SCAN_TRY(const TriangleMesh mesh, ReadMesh(options.mesh));
  SCAN_TRY(const PhotoSet photos, LoadPhotoSet(options.session));
  SCAN_TRY(const std::vector<Mask> masks,
           MakeEvidence(photos, options.stages, context.progress, context.stop));
  if (options.stages.fiducials.wanted()) {
    SCAN_TRY(
        options.stages.joint.bead_findings,
        FindFiducials(options.stages.fiducials, nullptr, photos, context.progress, context.stop));
  }
  SCAN_TRY(Poses poses,
           SolvePoses(mesh, photos, masks, options.stages, context.progress, context.stop));
  poses.model = options.mesh.filename().string();
  SCAN_CHECK(WritePoseFiles(staged.path(), poses, photos));
  SCAN_CHECK(staged.Commit());
  return CommandOutput{
      {{"poses", (staged.target() / "poses.json").string()}, {"views", PoseSummary(poses)}},
      PoseText(poses)};
}

Result<CommandOutput> RunTexture(ModelOptions& options, const CliContext& context) {
  SCAN_TRY(StagedFolder staged, StagedFolder::Create(options.out, options.force));
  SCAN_TRY(const AtlasMesh atlas, ReadAtlasObj(options.mesh));
  SCAN_TRY(const PhotoSet photos, LoadPhotoSet(options.session));
  SCAN_TRY(const Poses poses, ReadPoses(options.poses));
  SCAN_TRY(const std::vector<Mask> masks,
           MakeEvidence(photos, options.stages, context.progress, context.stop));
  SCAN_TRY(const TextureResult texture,
           MakeTexture(atlas, photos, poses, masks, options.stages.texture, context.progress,
                       context.stop));
  SCAN_CHECK(WriteModelFiles(staged.path(), atlas, texture, poses));
  SCAN_CHECK(staged.Commit());
  return CommandOutput{{{"model", (staged.target() / "model.glb").string()},
                        {"coverage", texture.report.measured_share}},
                       fmt::format("{:.1f} % of the surface measured: {}\n",
                                   100 * texture.report.measured_share, staged.target().string())};
}

Result<CommandOutput> RunReconstruct(ModelOptions& options, const CliContext& context) {
  SCAN_CHECK(Resolve(options));
  const ReconstructRequest request{.session = options.session,
                                   .volume = options.volume,
                                   .mesh = options.mesh,
                                   .out = options.out,
                                   .force = options.force,
                                   .options = options.stages};
  SCAN_TRY(const ReconstructResult result, Reconstruct(request, context.progress, context.stop));
  Json seconds = Json::object();
  for (const StageSeconds& stage : result.stages) seconds[stage.stage] = stage.seconds;
  return CommandOutput{
      {{"views", PoseSummary(result.poses)},
       {"views_accepted", result.views_accepted},
       {"coverage", result.coverage},
       {"seconds", seconds},
       {"model", result.model.string()},
       {"report", result.report.string()},
       {"poses", result.poses_file.string()}},
      PoseText(result.poses) +
          fmt::format(
              "{} of {} views accepted, {:.1f} % of the surface measured\nmodel   {}\nreport  {}\n",
              result.views_accepted, result.poses.views.size(), 100 * result.coverage,
              result.model.string(), result.report.string())};
}

using RunModel = Result<CommandOutput> (*)(ModelOptions&, const CliContext&);

CLI::App& AddModel(CommandSet& commands, const char* name, const char* description, RunModel run,
                   const std::shared_ptr<ModelOptions>& options) {
  return commands.Add(name, description,
                      [options, run](const CliContext& context) { return run(*options, context); });
}

}  // namespace

void AddSurface(CommandSet& commands) {
  auto options = std::make_shared<ModelOptions>();
  CLI::App& command =
      AddModel(commands, "surface", "CT volume to a closed mesh", RunSurface, options);
  command.add_option("volume", options->volume, "volume file or folder of slices")->required();
  AddOut(command, *options, "PLY file to write");
  AddPicture(command, *options);
  AddVolumeOptions(command, *options);
}

void AddAtlas(CommandSet& commands) {
  auto options = std::make_shared<ModelOptions>();
  CLI::App& command =
      AddModel(commands, "atlas", "Mesh to a mesh with texture coordinates", RunAtlas, options);
  command.add_option("mesh", options->mesh, "PLY or OBJ file")->required();
  AddOut(command, *options, "OBJ file to write");
  AddPicture(command, *options);
  AddAtlasOptions(command, *options);
}

void AddMasks(CommandSet& commands) {
  auto options = std::make_shared<ModelOptions>();
  CLI::App& command =
      AddModel(commands, "masks", "Cut the specimen out of a session's photographs (derived/masks)",
               RunMasks, options);
  command.add_option("session", options->session, "session folder")->required();
}

void AddPose(CommandSet& commands) {
  auto options = std::make_shared<ModelOptions>();
  CLI::App& command = AddModel(
      commands, "pose", "Find the camera of every photograph against a mesh", RunPose, options);
  command.add_option("session", options->session, "session folder")->required();
  command.add_option("--mesh", options->mesh, "PLY or OBJ file, mm")->required();
  AddOut(command, *options, "folder to write");
  AddPoseOptions(command, *options);
  AddBeadOptions(command, *options);
}

void AddTexture(CommandSet& commands) {
  auto options = std::make_shared<ModelOptions>();
  CLI::App& command =
      AddModel(commands, "texture", "Photographs onto a mesh with an atlas", RunTexture, options);
  command.add_option("session", options->session, "session folder")->required();
  command.add_option("--mesh", options->mesh, "OBJ file with texture coordinates")->required();
  command.add_option("--poses", options->poses, "poses.json")->required();
  AddEvidenceOptions(command, *options);
  AddOut(command, *options, "folder to write");
}

void AddReconstruct(CommandSet& commands) {
  auto options = std::make_shared<ModelOptions>();
  CLI::App& command = AddModel(commands, "reconstruct",
                               "A session and a CT volume (or a mesh of it) to one textured model",
                               RunReconstruct, options);
  command.add_option("session", options->session, "session folder")->required();
  command.add_option("--volume", options->volume, "CT volume: file or folder of slices");
  command.add_option("--mesh", options->mesh, "mesh of the specimen, mm");
  AddOut(command, *options, "folder to write");
  AddVolumeOptions(command, *options);
  AddAtlasOptions(command, *options);
  AddPoseOptions(command, *options);
  AddAppearanceOptions(command, *options);
  command
      .add_option("--bead-mm", options->stages.fiducials.bead_mm,
                  "joint: diameter of beads on specimen or holder, denser than it")
      ->check(Positive());
  AddBeadOptions(command, *options);
}

}  // namespace scan
