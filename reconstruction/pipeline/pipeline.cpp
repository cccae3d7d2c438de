#include "reconstruction/pipeline/pipeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "drivers/base/staged_folder.h"
#include "drivers/base/units.h"
#include "reconstruction/export/glb.h"
#include "reconstruction/mesh/mesh_io.h"
#include "reconstruction/pose/exclude_below.h"
#include "reconstruction/pose/pose_exports.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

// Measures one stage; the table of the report and of the demo.
class Stopwatch {
 public:
  explicit Stopwatch(std::vector<StageSeconds>& stages) : stages_(stages) {}
  void Lap(std::string stage) {
    const auto now = std::chrono::steady_clock::now();
    stages_.push_back({std::move(stage), std::chrono::duration<double>(now - last_).count()});
    last_ = now;
  }

 private:
  std::vector<StageSeconds>& stages_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

Status CheckRequest(const ReconstructRequest& request) {
  if (request.volume.empty() == request.mesh.empty())
    return BadInput("need either a volume or a mesh", "reconstruct",
                    "give one of --volume and --mesh");
  return {};
}

// Stored pixels of a picture file, written whole or not at all (inside a staged folder).
Status WritePicture(const fs::path& path, const cv::Mat& picture) {
  if (!cv::imwrite(path.string(), picture, {cv::IMWRITE_PNG_COMPRESSION, 3}))
    return Failed("cannot write the picture", path.string(), "check the free space");
  return {};
}

// In the file R, G, B are class, view and incidence; OpenCV writes the channels backwards.
cv::Mat AsStored(const cv::Mat& provenance) {
  cv::Mat stored;
  cv::cvtColor(provenance, stored, cv::COLOR_RGB2BGR);
  return stored;
}

double MedianOf(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<long>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::vector<Figure> MainFigures(const ReconstructResult& result, const SurfaceResult* surface,
                                const AtlasReport& atlas) {
  std::vector<double> residuals, sigmas;
  for (const ViewPose& view : result.poses.views) {
    if (view.status != ViewStatus::accepted) continue;
    residuals.push_back(view.contour_rms_px);
    sigmas.push_back(view.surface_sigma_px.median);
  }
  std::vector<Figure> figures;
  figures.push_back({"views accepted",
                     fmt::format("{} of {}", result.views_accepted, result.poses.views.size()),
                     "method " + result.poses.method});
  figures.push_back({"contour residual", fmt::format("{:.3f} px", MedianOf(residuals)),
                     "RMS along the contour, full size, median over the accepted views"});
  figures.push_back({"surface σ", fmt::format("{:.3f} px", MedianOf(sigmas)),
                     "expected reprojection error of surface points, full size, median"});
  for (const AppearanceFinding& found : result.turns)
    figures.push_back(
        {"turn of " + found.direction.of,
         found.turn.decided ? fmt::format("σ {:.2f}°", DegFromRad(found.turn.sigma_rad))
                            : "not decided",
         fmt::format("free by the silhouettes, judged by colour; views agree within {:.2f}°",
                     DegFromRad(found.view_spread_rad))});
  figures.push_back({"texture measured", fmt::format("{:.1f} %", 100 * result.coverage),
                     "share of the surface's area; the rest is filled and marked so"});
  figures.push_back(
      {"faces", fmt::format("{}", result.surface.faces.size()),
       surface ? (surface->topology.closed_manifold() ? "closed manifold" : "not a closed manifold")
               : "mesh as given"});
  figures.push_back({"charts", fmt::format("{}", atlas.charts),
                     fmt::format("{:.1f} texels per mm, {:.0f} % of the atlas used",
                                 atlas.texels_per_mm, 100 * atlas.texel_usage)});
  return figures;
}

}  // namespace

Result<std::vector<Mask>> MakeEvidence(const PhotoSet& photos, const StageOptions& options,
                                       const ProgressFn& progress, std::stop_token stop) {
  SCAN_TRY(std::vector<Mask> masks, MakeMasks(photos, options.masks, progress, stop));
  if (options.exclude_below_mm) SCAN_CHECK(ExcludeBelow(photos, *options.exclude_below_mm, masks));
  return masks;
}

Result<Poses> SolvePoses(const TriangleMesh& mesh, const PhotoSet& photos,
                         std::span<const Mask> masks, const StageOptions& options,
                         const ProgressFn& progress, std::stop_token stop) {
  if (options.method == PoseMethod::paper && !options.joint.bead_findings.beads.empty())
    return BadInput("the paper's method knows no beads", "--method", "leave out --bead-colour");
  if (options.method == PoseMethod::paper)
    return SolvePaper(mesh, photos, masks, options.paper, progress, stop);
  return SolveJoint(mesh, photos, masks, options.joint, progress, stop);
}

Status WritePoseFiles(const fs::path& folder, const Poses& poses, const PhotoSet& photos) {
  std::error_code code;
  fs::create_directories(folder, code);
  SCAN_CHECK(WritePoses(folder / "poses.json", poses));
  SCAN_CHECK(WriteTransforms(folder, poses, photos));
  return WriteColmap(folder, poses, photos);
}

Status WriteModelFiles(const fs::path& folder, const AtlasMesh& atlas, const TextureResult& texture,
                       const Poses& poses) {
  SCAN_CHECK(WriteAtlasObj(folder / "atlas.obj", atlas, "albedo.png"));
  SCAN_CHECK(WritePicture(folder / "albedo.png", texture.albedo));
  SCAN_CHECK(WritePicture(folder / "provenance.png", AsStored(texture.provenance)));
  GlbOptions glb;
  if (!poses.mountings.empty()) glb.table_from_model = poses.mountings.front().table_from_model;
  return WriteGlb(folder / "model.glb", atlas, texture.albedo, glb);
}

Result<ReconstructResult> Reconstruct(const ReconstructRequest& request, const ProgressFn& progress,
                                      std::stop_token stop) {
  SCAN_CHECK(CheckRequest(request));
  SCAN_TRY(StagedFolder staged, StagedFolder::Create(request.out, request.force));
  const fs::path& folder = staged.path();
  StageOptions options = request.options;
  ReconstructResult result;
  Stopwatch stopwatch(result.stages);

  SCAN_TRY(result.photos, LoadPhotoSet(request.session));
  std::optional<SurfaceResult> surface;
  std::optional<Volume> volume;
  if (!request.volume.empty()) {
    SCAN_TRY(volume, ReadVolume(request.volume, options.volume));
    stopwatch.Lap("read volume");
    SCAN_TRY(surface, ExtractSurface(*volume, options.surface, progress, stop));
    result.surface = surface->mesh;
    stopwatch.Lap("surface");
    if (options.fiducials.wanted()) {
      SCAN_TRY(options.joint.bead_findings,
               FindFiducials(options.fiducials, &*volume, result.photos, progress, stop));
      stopwatch.Lap("beads");
    }
  } else {
    SCAN_TRY(result.surface, ReadMesh(request.mesh));
    stopwatch.Lap("read mesh");
    if (options.fiducials.wanted()) {
      SCAN_TRY(options.joint.bead_findings,
               FindFiducials(options.fiducials, nullptr, result.photos, progress, stop));
    }
  }
  if (!options.joint.bead_findings.beads.empty())
    SCAN_CHECK(WriteBeads(folder / "beads.json", options.joint.bead_findings.beads));
  SCAN_CHECK(WritePly(folder / "surface.ply", result.surface));

  SCAN_TRY(const AtlasResult atlas, MakeAtlas(result.surface, options.atlas, progress, stop));
  stopwatch.Lap("atlas");
  SCAN_TRY(const std::vector<Mask> masks, MakeEvidence(result.photos, options, progress, stop));
  stopwatch.Lap("masks");
  SCAN_TRY(result.poses, SolvePoses(result.surface, result.photos, masks, options, progress, stop));
  SCAN_TRY(result.turns, DecideFreeTurns(result.surface, volume ? &*volume : nullptr, result.photos,
                                         masks, options.appearance, result.poses, progress, stop));
  volume.reset();  // the largest of all that is held
  result.poses.model = "surface.ply";
  SCAN_CHECK(WritePoseFiles(folder / "poses", result.poses, result.photos));
  result.views_accepted = static_cast<std::size_t>(
      std::count_if(result.poses.views.begin(), result.poses.views.end(),
                    [](const ViewPose& v) { return v.status == ViewStatus::accepted; }));
  stopwatch.Lap("poses");

  TextureOptions texture_options = options.texture;
  texture_options.size_px = options.atlas.size_px;
  SCAN_TRY(const TextureResult texture, MakeTexture(atlas.atlas, result.photos, result.poses, masks,
                                                    texture_options, progress, stop));
  result.coverage = texture.report.measured_share;
  stopwatch.Lap("texture");
  SCAN_CHECK(WriteModelFiles(folder, atlas.atlas, texture, result.poses));
  stopwatch.Lap("export");

  ReportInput report;
  report.title = "scanstation: " + fs::absolute(request.session).filename().string();
  report.figures = MainFigures(result, surface ? &*surface : nullptr, atlas.report);
  report.stages = result.stages;
  report.notes = result.poses.notes;
  report.photos = &result.photos;
  report.masks = masks;
  report.poses = &result.poses;
  report.atlas = &atlas.atlas;
  report.albedo = &texture.albedo;
  report.provenance = &texture.provenance;
  report.view_coverage = texture.report.view_share;
  SCAN_CHECK(WriteReport(folder / "report.html", report));
  stopwatch.Lap("report");

  SCAN_CHECK(staged.Commit());
  result.model = staged.target() / "model.glb";
  result.report = staged.target() / "report.html";
  result.poses_file = staged.target() / "poses" / "poses.json";
  return result;
}

}  // namespace scan
