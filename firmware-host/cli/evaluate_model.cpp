#include "firmware-host/cli/evaluate_model.h"

#include <fmt/format.h>

#include "firmware-host/cli/figures.h"
#include "reconstruction/evaluate/calibrated.h"
#include "reconstruction/mesh/mesh_io.h"
#include "reconstruction/pipeline/pipeline.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

std::string Row(const char* name, const Spread& s) {
  return fmt::format("  {:<40} {:8.3f} {:8.3f} {:8.3f}\n", name, s.median, s.p95, s.max);
}

std::string Rows(const char* name, const OutlineDistances& d) {
  return Row(name, d.px) +
         Row(fmt::format("  less the {:+.3f} px common to all", d.swell_px).c_str(), d.even_px);
}

CommandOutput OutputOf(const CalibratedFigures& f) {
  CommandOutput output;
  Json lens = Json::array();
  std::string lens_text;
  for (const MovedParameter& p : f.lens) {
    lens.push_back({{"lens_state", p.lens},
                    {"name", p.name},
                    {"moved", p.moved},
                    {"sigma", p.sigma},
                    {"prior_sigma", p.prior_sigma},
                    {"calibrated", p.truth}});
    lens_text += fmt::format(
        "  {} {:<8} moved {:9.4f}, sigma {:8.4f} ({:.2f} of its prior), calibrated {:9.4f}\n",
        p.lens, p.name, p.moved, p.sigma, p.sigma / p.prior_sigma, p.truth);
  }
  output.json = {{"views", f.views},
                 {"accepted", f.accepted},
                 {"rotation_between_neighbours_deg", ToJson(f.neighbour_deg)},
                 {"rotation_after_alignment_deg", ToJson(f.aligned_deg)},
                 {"axis_deg", f.axis_deg ? Json(*f.axis_deg) : Json()},
                 {"lens", lens},
                 {"contour_px", ToJson(f.contour.px)},
                 {"contour_swell_px", f.contour.swell_px},
                 {"contour_even_px", ToJson(f.contour.even_px)},
                 {"contour_calibrated_px", ToJson(f.contour_calibrated.px)},
                 {"contour_calibrated_swell_px", f.contour_calibrated.swell_px},
                 {"contour_calibrated_even_px", ToJson(f.contour_calibrated.even_px)}};
  output.text = fmt::format("{} of {} views accepted\n{:<42} {:>8} {:>8} {:>8}\n", f.accepted,
                            f.views, "", "median", "p95", "max") +
                Row("rotation between neighbours, deg", f.neighbour_deg) +
                Row("rotation after one alignment, deg", f.aligned_deg) +
                Rows("mesh's outline to the photograph's, px", f.contour) +
                Rows("the same at the calibrated poses, px", f.contour_calibrated);
  if (f.axis_deg)
    output.text +=
        fmt::format("  turntable axis against the calibrated one {:.3f} deg\n", *f.axis_deg);
  output.text += lens_text;
  return output;
}

}  // namespace

Result<CommandOutput> EvaluateModel(const EvaluateModelOptions& options,
                                    const CliContext& context) {
  if (options.truth.empty() || options.session.empty())
    return BadInput("need the calibrated cameras and the session", "evaluate",
                    "give --truth and --session");
  fs::path poses_file = options.model / "poses" / "poses.json";
  if (!fs::exists(poses_file)) poses_file = options.model / "poses.json";
  SCAN_TRY(const Poses poses, ReadPoses(poses_file));
  SCAN_TRY(const CalibratedCameras truth, ReadCalibrated(options.truth));
  SCAN_TRY(const TriangleMesh mesh,
           ReadMesh(options.mesh.empty() ? options.model / "surface.ply" : options.mesh));
  SCAN_TRY(const PhotoSet photos, LoadPhotoSet(options.session));
  if (photos.photos.size() != poses.views.size())
    return BadInput(
        fmt::format("{} poses for {} photographs", poses.views.size(), photos.photos.size()),
        poses_file.string(), "give the session that these poses were found for");
  for (std::size_t i = 0; i < photos.photos.size(); ++i)
    if (photos.photos[i].name != poses.views[i].name)
      return BadInput(fmt::format("the pose of '{}' where the session has '{}'",
                                  poses.views[i].name, photos.photos[i].name),
                      poses_file.string(), "give the session that these poses were found for");
  StageOptions stages;
  stages.exclude_below_mm = options.exclude_below_mm;
  SCAN_TRY(const std::vector<Mask> masks,
           MakeEvidence(photos, stages, context.progress, context.stop));
  SCAN_TRY(const CalibratedFigures figures,
           CompareWithCalibrated(poses, truth, mesh, photos, masks));
  return OutputOf(figures);
}

}  // namespace scan
