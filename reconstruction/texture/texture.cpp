#include "reconstruction/texture/texture.h"

#include <fmt/format.h>

#include <cassert>
#include <chrono>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "drivers/base/units.h"
#include "reconstruction/texture/fill.h"
#include "reconstruction/texture/merge.h"
#include "reconstruction/texture/project_view.h"
#include "reconstruction/texture/texels.h"

namespace scan {
namespace {

class Stopwatch {
 public:
  double Lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - start_).count();
    start_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

Status CheckInput(const AtlasMesh& atlas, const TextureOptions& o) {
  const std::size_t vertices = atlas.mesh.vertices.size();
  if (atlas.mesh.faces.empty() || atlas.uv.size() != vertices ||
      atlas.source_vertex.size() != vertices || atlas.chart.size() != atlas.mesh.faces.size()) {
    return BadInput("the mesh has no faces or no whole texture coordinates", "atlas",
                    "make one with `scanstation atlas`");
  }
  for (const Eigen::Vector2d& uv : atlas.uv) {
    if (!(uv.minCoeff() >= 0 && uv.maxCoeff() <= 1)) {
      return BadInput("a texture coordinate lies outside [0, 1]", "atlas",
                      "make one with `scanstation atlas`");
    }
  }
  const bool good = o.size_px >= 16 && o.size_px <= 16384 && o.max_incidence_deg > 0 &&
                    o.max_incidence_deg < 90 && o.feather_texels >= 0 && o.feather_texels <= 32 &&
                    o.smoothing_steps >= 0 && o.smoothing_steps <= 10000;
  if (good) return {};
  return BadInput("an option is out of range", "texture options",
                  "see the ranges in reconstruction/texture/texture.h");
}

// The accepted views with the photographs they belong to, in the order of the set.
std::vector<std::pair<std::size_t, const ViewPose*>> AcceptedViews(const PhotoSet& photos,
                                                                   const Poses& poses) {
  std::vector<std::pair<std::size_t, const ViewPose*>> accepted;
  for (std::size_t i = 0; i < photos.photos.size(); ++i) {
    for (const ViewPose& view : poses.views) {
      if (view.name != photos.photos[i].name || view.status != ViewStatus::accepted) continue;
      accepted.emplace_back(i, &view);
      break;
    }
  }
  return accepted;
}

Result<ViewToProject> ReadView(const PhotoSet& photos, std::size_t i, const ViewPose& pose,
                               const Poses& poses, const Mask& mask) {
  const Photo& photo = photos.photos[i];
  ViewToProject view;
  view.intrinsics = IntrinsicsOf(poses, pose, photos.intrinsics(photo));
  view.camera_from_model = pose.camera_from_model;
  view.mask = &mask;
  view.index = static_cast<std::uint16_t>(i);
  try {
    view.photo = cv::imread(photo.path.string(), cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    view.photo.release();
  }
  const cv::Size size(view.intrinsics.w, view.intrinsics.h);
  if (view.photo.empty()) {
    return BadInput("the photograph cannot be read", photo.path.string(),
                    "give a whole PNG, JPEG or TIFF");
  }
  if (view.photo.size() != size || mask.coverage.size() != size || mask.coverage.type() != CV_8U ||
      (!mask.ignore.empty() && mask.ignore.size() != size)) {
    return BadInput(fmt::format("photograph {} x {}, mask {} x {}, camera {} x {} differ",
                                view.photo.cols, view.photo.rows, mask.coverage.cols,
                                mask.coverage.rows, size.width, size.height),
                    photo.path.string(), "use the pictures that the poses were made from");
  }
  return view;
}

void Paint(const Texels& texels, const Layer& layer, TextureResult& out) {
  out.albedo = cv::Mat(texels.size_px, texels.size_px, CV_8UC3, cv::Scalar::all(0));
  out.provenance = cv::Mat(texels.size_px, texels.size_px, CV_16UC3, cv::Scalar(0, kNoView, 0));
  for (std::size_t i = 0; i < texels.size(); ++i) {
    cv::Vec3b& colour = out.albedo.ptr<cv::Vec3b>()[texels.place[i]];
    for (int c = 0; c < 3; ++c) colour[c] = static_cast<uchar>((layer.colour[i][c] + 128) / 257);
    const double incidence_deg =
        layer.view[i] == kNoView ? 0 : DegFromRad(std::acos(std::min(1.f, layer.cosine[i])));
    out.provenance.ptr<cv::Vec3w>()[texels.place[i]] = cv::Vec3w(
        layer.kind[i], layer.view[i], static_cast<std::uint16_t>(std::lround(100 * incidence_deg)));
  }
}

void Summarise(const Texels& texels, const Layer& layer, const PhotoSet& photos,
               TextureReport& report) {
  report.view_share.assign(photos.photos.size(), 0);
  for (const Photo& photo : photos.photos) report.view_names.push_back(photo.name);
  double area = 0;
  for (std::size_t i = 0; i < texels.size(); ++i) {
    area += texels.area_mm2[i];
    if (layer.view[i] != kNoView) report.view_share[layer.view[i]] += texels.area_mm2[i];
  }
  for (double& share : report.view_share) {
    share /= area > 0 ? area : 1;
    report.measured_share += share;
  }
}

}  // namespace

Result<TextureResult> MakeTexture(const AtlasMesh& atlas, const PhotoSet& photos,
                                  const Poses& poses, std::span<const Mask> masks,
                                  const TextureOptions& options, const ProgressFn& progress,
                                  std::stop_token stop) {
  assert(masks.size() == photos.photos.size());
  SCAN_CHECK(CheckInput(atlas, options));
  const auto accepted = AcceptedViews(photos, poses);
  if (accepted.empty()) {
    return BadInput("no photograph has an accepted pose", "poses",
                    "look at the reasons of the rejections in poses.json");
  }
  TextureResult out;
  Stopwatch watch;
  const Texels texels = MakeTexels(atlas, MakeTexelMap(atlas, options.size_px));
  Layer result = MakeLayer(texels.size());
  out.report.project_seconds += watch.Lap();
  for (std::size_t k = 0; k < accepted.size(); ++k) {
    if (stop.stop_requested()) return Cancelled("texture");
    const auto [i, pose] = accepted[k];
    SCAN_TRY(const ViewToProject view, ReadView(photos, i, *pose, poses, masks[i]));
    const Layer layer =
        ProjectView(texels, atlas.mesh, view, RadFromDeg(options.max_incidence_deg));
    out.report.project_seconds += watch.Lap();
    if (options.method == MergeMethod::best_view) {
      MergeBestView(layer, result);
    } else {
      const SeamSummary seam = MergeBySeam(texels, layer, options.feather_texels, result);
      out.report.seam_pairs += seam.pairs;
      out.report.seam_cost += seam.cost;
    }
    out.report.merge_seconds += watch.Lap();
    Report(progress, "texture",
           static_cast<double>(k + 1) / static_cast<double>(accepted.size() + 1));
  }
  Summarise(texels, result, photos, out.report);
  if (!(out.report.measured_share > 0)) {
    return Failed("no photograph shows any part of the surface", "texture",
                  "check that poses, masks and mesh belong together");
  }
  FillUnseen(texels, options.smoothing_steps, result);
  Paint(texels, result, out);
  PadGutters(texels, out.albedo);
  out.report.fill_seconds = watch.Lap();
  Report(progress, "texture", 1);
  return out;
}

}  // namespace scan
