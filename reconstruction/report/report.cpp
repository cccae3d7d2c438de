#include "reconstruction/report/report.h"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "drivers/base/files.h"
#include "drivers/base/units.h"
#include "reconstruction/render/rasterise.h"
#include "reconstruction/report/pictures.h"
#include "reconstruction/report/pose_pictures.h"
#include "reconstruction/report/pose_plots.h"

namespace scan {
namespace {

constexpr int kPanelPx = 420;  // longest side of a view's panel
constexpr int kAtlasPx = 640;  // side of the atlas pictures
constexpr int kRingPx = 760;   // width of the camera ring
constexpr int kPlotWidePx = 560, kPlotHighPx = 340;

constexpr char kStyle[] = R"css(
:root{color-scheme:light dark;--line:#8884;--bad:#c0392b;--good:#2e8b57}
body{font:15px/1.5 system-ui,sans-serif;max-width:1360px;margin:2rem auto;padding:0 1rem}
h1{font-size:1.6rem;margin-bottom:.2rem}h2{margin-top:2.2rem;font-size:1.2rem}
table{border-collapse:collapse}td,th{padding:.25rem .8rem;border-bottom:1px solid var(--line);text-align:left;vertical-align:top}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}
.view{border-top:1px solid var(--line);padding:1rem 0}.panels{display:flex;flex-wrap:wrap;gap:.6rem}
figure{margin:0}figcaption{font-size:.85rem;opacity:.75}img{max-width:100%;border-radius:4px;background:#fff}
.rejected{color:var(--bad);font-weight:600}.accepted{color:var(--good);font-weight:600}
.key span{display:inline-block;width:.8em;height:.8em;margin:0 .3em 0 1em;border-radius:2px;border:1px solid var(--line)}
.note{border-left:4px solid #d9a400;padding:.2rem .8rem;margin:.6rem 0}
)css";

std::string Escaped(std::string_view text) {
  std::string out;
  for (char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string DataUri(const cv::Mat& picture, const char* extension, const char* mime) {
  std::vector<uchar> bytes;
  std::vector<int> options;
  if (std::string_view(extension) == ".jpg") options = {cv::IMWRITE_JPEG_QUALITY, 86};
  cv::imencode(extension, picture, bytes, options);
  std::string base64(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  const int length = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(base64.data()), bytes.data(),
                                     static_cast<int>(bytes.size()));
  base64.resize(static_cast<std::size_t>(length));
  return fmt::format("data:{};base64,{}", mime, base64);
}

std::string FigureHtml(const cv::Mat& picture, const std::string& caption, bool drawn = false) {
  return fmt::format(
      "<figure><img loading=\"lazy\" width=\"{}\" height=\"{}\" alt=\"{}\" src=\"{}\">"
      "<figcaption>{}</figcaption></figure>\n",
      picture.cols, picture.rows, Escaped(caption),
      drawn ? DataUri(picture, ".png", "image/png") : DataUri(picture, ".jpg", "image/jpeg"),
      Escaped(caption));
}

std::string FiguresTable(const std::vector<Figure>& figures) {
  std::string html = "<table>\n";
  for (const Figure& f : figures)
    html += fmt::format("<tr><th>{}</th><td class=\"n\">{}</td><td>{}</td></tr>\n", Escaped(f.name),
                        Escaped(f.value), Escaped(f.remark));
  return html + "</table>\n";
}

std::string StagesTable(const std::vector<StageSeconds>& stages) {
  std::string html = "<table><tr><th>stage</th><th class=\"n\">seconds</th></tr>\n";
  double total = 0;
  for (const StageSeconds& s : stages) {
    total += s.seconds;
    html += fmt::format("<tr><td>{}</td><td class=\"n\">{:.2f}</td></tr>\n", Escaped(s.stage),
                        s.seconds);
  }
  return html + fmt::format("<tr><th>total</th><td class=\"n\">{:.2f}</td></tr></table>\n", total);
}

std::string EstimatesTable(const Poses& poses) {
  std::string html =
      "<table><tr><th>shared by the views</th><th class=\"n\">value</th><th class=\"n\">σ</th>"
      "<th class=\"n\">prior σ</th><th class=\"n\">σ / prior σ</th></tr>\n";
  const auto row = [&html](const std::string& name, const SharedEstimate& e) {
    html += fmt::format(
        "<tr><td>{}</td><td class=\"n\">{:.6g}</td><td class=\"n\">{:.3g}</td>"
        "<td class=\"n\">{:.3g}</td><td class=\"n\">{}</td></tr>\n",
        Escaped(name), e.value, e.sigma, e.prior_sigma,
        e.prior_sigma > 0 ? fmt::format("{:.2f}", e.sigma / e.prior_sigma) : "–");
  };
  for (const auto& [id, lens] : poses.lens_states)
    for (const auto& [name, estimate] : lens.parameters) row(id + " " + name, estimate);
  for (const auto& [name, estimate] : poses.nuisances) row(name, estimate);
  return html + "</table>\n";
}

std::string FreeDirectionsList(const Poses& poses) {
  if (poses.free_directions.empty())
    return "<p>The photographs determine every direction of every pose.</p>\n";
  static constexpr const char* kKinds[] = {"rotation", "translation", "scale"};
  static constexpr const char* kScopes[] = {"mounting", "view", "shared"};
  std::string html = "<p>The photographs do not determine:</p><ul>\n";
  for (const FreeDirection& f : poses.free_directions)
    html += fmt::format(
        "<li>{} of {} {} {} the axis ({:.3f}, {:.3f}, {:.3f}) through ({:.2f}, {:.2f}, {:.2f}) "
        "mm"
        " of the model frame; held by: {}</li>\n",
        kKinds[static_cast<int>(f.kind)], kScopes[static_cast<int>(f.scope)], Escaped(f.of),
        f.kind == FreeDirection::Kind::rotation ? "about" : "along", f.axis.x(), f.axis.y(),
        f.axis.z(), f.point.x(), f.point.y(), f.point.z(), Escaped(f.held_by));
  return html + "</ul>\n";
}

Result<std::string> ViewHtml(const ReportInput& input, std::size_t index) {
  const ViewPose& view = input.poses->views[index];
  const Photo& photo = input.photos->photos[index];
  const cv::Mat picture =
      cv::imread(photo.path.string(), cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  if (picture.empty())
    return BadInput("cannot read the photograph", photo.path.string(), "check the file");
  const bool solved = view.status == ViewStatus::accepted;
  const Intrinsics& intrinsics = IntrinsicsOf(*input.poses, view, input.photos->intrinsics(photo));
  const bool has_pose = view.camera_from_model.translation().z() > 0;

  const cv::Mat& photo_mask = input.masks[index].coverage;
  const cv::Mat model_mask =
      has_pose ? RasteriseMask(input.atlas->mesh, view.camera_from_model, intrinsics)
               : cv::Mat(photo_mask.size(), CV_8U, cv::Scalar(0));
  const Crop crop = CropAround(photo_mask, solved ? model_mask : photo_mask, kPanelPx);
  const cv::Mat photo_crop = CropOf(picture, crop);

  std::string html = fmt::format("<div class=\"view\"><h3>{} <span class=\"{}\">{}</span></h3>\n",
                                 Escaped(view.name), solved ? "accepted" : "rejected",
                                 solved ? "accepted" : "rejected: " + Escaped(view.reason));
  html += fmt::format(
      "<p>cost {:.3f} px (Eq 3 at 462 px; city-block {:.3f}), contour residual {:.3f} px RMS, "
      "surface σ {:.3f} px median, {:.3f} px p95 (full size){}</p>\n<div class=\"panels\">\n",
      view.cost_px, view.cost_l1_px, view.contour_rms_px, view.surface_sigma_px.median,
      view.surface_sigma_px.p95,
      index < input.view_coverage.size()
          ? fmt::format(", {:.1f} % of the surface taken from it", 100 * input.view_coverage[index])
          : "");
  html += FigureHtml(photo_crop, "photograph");
  html += FigureHtml(DrawOverlay(photo_crop, CropOf(photo_mask, crop), CropOf(model_mask, crop)),
                     "contours: photograph green, model magenta, both white");
  if (has_pose)
    html += FigureHtml(RenderTextured(*input.atlas, *input.albedo, view.camera_from_model,
                                      CropIntrinsics(intrinsics, crop)),
                       "model from this camera");
  return html + "</div></div>\n";
}

std::string AtlasHtml(const ReportInput& input) {
  cv::Mat albedo, provenance;
  cv::resize(*input.albedo, albedo, {kAtlasPx, kAtlasPx}, 0, 0, cv::INTER_AREA);
  cv::resize(ProvenanceColours(*input.provenance), provenance, {kAtlasPx, kAtlasPx}, 0, 0,
             cv::INTER_AREA);
  return "<div class=\"panels\">" + FigureHtml(albedo, "texture atlas") +
         FigureHtml(provenance, "where each texel comes from") +
         "</div>\n<p class=\"key\"><span style=\"background:#3ca060\"></span>measured"
         "<span style=\"background:#50bec8\"></span>blended"
         "<span style=\"background:#f08c3c\"></span>filled"
         "<span style=\"background:#dc3c3c\"></span>synthesised"
         "<span style=\"background:#fff\"></span>no surface</p>\n";
}

std::string RingHtml(const ReportInput& input) {
  const auto cameras = RingOf(*input.photos, *input.poses);
  const RingPicture ring = DrawRing(cameras, input.atlas->mesh, input.poses->free_directions,
                                    UpInModel(*input.photos, *input.poses), kRingPx);
  if (ring.picture.empty()) return "";
  const bool logged = std::any_of(cameras.begin(), cameras.end(),
                                  [](const RingCamera& c) { return c.nominal.has_value(); });
  std::string caption =
      "Cameras round the model, solved ones filled (red: rejected) with their "
      "viewing direction";
  if (logged)
    caption += fmt::format(
        ", logged ones hollow; differences between both drawn {:g} times as long", ring.enlarged);
  if (!input.poses->free_directions.empty()) caption += "; dashed: axis of a free rotation";
  return FigureHtml(ring.picture, caption + ".", true);
}

struct EllipsePicture {
  cv::Mat photo;
  std::vector<SurfaceEllipse> ellipses;  // in its pixels
};

Result<EllipsePicture> EllipsesOf(const ReportInput& input, std::size_t index) {
  const ViewPose& view = input.poses->views[index];
  const Photo& photo = input.photos->photos[index];
  const cv::Mat picture =
      cv::imread(photo.path.string(), cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  if (picture.empty())
    return BadInput("cannot read the photograph", photo.path.string(), "check the file");
  const Intrinsics& intrinsics = IntrinsicsOf(*input.poses, view, input.photos->intrinsics(photo));
  const cv::Mat& mask = input.masks[index].coverage;
  const Crop crop = CropAround(mask, mask, kPanelPx);
  EllipsePicture drawn{CropOf(picture, crop),
                       SurfaceEllipses(input.atlas->mesh, view, intrinsics, 8)};
  for (SurfaceEllipse& e : drawn.ellipses) {
    e.centre_px = crop.scale * (e.centre_px - Eigen::Vector2d(crop.full_px.x, crop.full_px.y));
    e.covariance_px2 *= crop.scale * crop.scale;
  }
  return drawn;
}

// `index` of the views, best determined first, least last; enlarged alike so that they compare.
Result<std::string> EllipsesHtml(const ReportInput& input, const std::vector<std::size_t>& index) {
  std::vector<EllipsePicture> drawn;
  for (const std::size_t i : index) {
    SCAN_TRY(EllipsePicture picture, EllipsesOf(input, i));
    drawn.push_back(std::move(picture));
  }
  const double factor = drawn.empty() ? 1 : EllipseFactor(drawn.back().ellipses, kPanelPx / 30.0);
  std::string html;
  for (std::size_t k = 0; k < drawn.size(); ++k) {
    const ViewPose& view = input.poses->views[index[k]];
    html += FigureHtml(
        DrawEllipses(drawn[k].photo, drawn[k].ellipses, factor),
        fmt::format("{}, the {} determined view: 1 σ of points of the surface, drawn {:g} times as "
                    "large (median {:.3f} px, full size).",
                    view.name, k + 1 == drawn.size() ? "least" : "best", factor,
                    view.surface_sigma_px.median));
  }
  return html;
}

// Where the cameras stand and how well that is known.
Result<std::string> CamerasHtml(const ReportInput& input) {
  std::string html = "<div class=\"panels\">" + RingHtml(input);
  const auto& views = input.poses->views;
  std::optional<std::size_t> best, worst;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (views[i].status != ViewStatus::accepted || !(views[i].surface_sigma_px.median > 0))
      continue;
    const auto sigma = [&](std::size_t k) { return views[k].surface_sigma_px.median; };
    if (!best || sigma(i) < sigma(*best)) best = i;
    if (!worst || sigma(i) > sigma(*worst)) worst = i;
  }
  std::vector<std::size_t> shown;
  if (best && best != worst) shown.push_back(*best);
  if (worst) shown.push_back(*worst);
  SCAN_TRY(const std::string ellipses, EllipsesHtml(input, shown));
  html += ellipses;
  return html + "</div>\n";
}

std::string PlotHtml(const Plot& plot, const std::string& caption) {
  const cv::Mat picture = DrawPlot(plot, {kPlotWidePx, kPlotHighPx}).picture;
  return picture.empty() ? "" : FigureHtml(picture, caption, true);
}

// How the solve went and what it rests on; empty where the method does not tell.
std::string SolveHtml(const PoseDiagnostics& solve) {
  std::string html = PlotHtml(
      ConvergencePlot(solve),
      fmt::format("The solve {} after {} iterations; the match window shrinks with the residuals.",
                  solve.converged ? "converged" : "was ended", solve.steps.size()));
  html += PlotHtml(CostPlot(solve),
                   "Cost of each iteration's rig solve; it may rise, for matches and weights are "
                   "found anew each time.");
  html +=
      PlotHtml(SpectrumPlot(solve.solve),
               fmt::format("Eigenvalues of the information of all parameters in units of their "
                           "prior's σ; of {} directions the photographs say less than the prior "
                           "in {}.",
                           solve.solve.lines.size(), HardlyInformed(solve.solve)));
  std::string least;
  for (const Spectrum& placing : solve.placings)
    least +=
        fmt::format("{}{}: {}", least.empty() ? "" : "; ", placing.of, LeastDetermined(placing, 1));
  html += PlotHtml(PlacingPlot(solve.placings),
                   "Eigenvalues of the information of the specimen's placing on the table, all "
                   "else marginalised, turns counted as mm at its radius; least determined of " +
                       least + ".");
  return html.empty()
             ? html
             : "<h2>Convergence and information</h2>\n<div class=\"panels\">" + html + "</div>\n";
}

}  // namespace

Status WriteReport(const std::filesystem::path& path, const ReportInput& input) {
  assert(input.photos && input.poses && input.atlas && input.albedo && input.provenance);
  assert(input.poses->views.size() == input.photos->photos.size());
  assert(input.masks.size() == input.photos->photos.size());

  std::vector<Result<std::string>> views(input.poses->views.size(), std::string());
  tbb::parallel_for(std::size_t{0}, views.size(),
                    [&](std::size_t i) { views[i] = ViewHtml(input, i); });

  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width\"><title>{0}</title>"
      "<style>{1}</style></head><body>\n<h1>{0}</h1>\n",
      Escaped(input.title), kStyle);
  for (const std::string& note : input.notes)
    html += "<p class=\"note\">" + Escaped(note) + "</p>\n";
  html += FiguresTable(input.figures);
  html += "<h2>Texture</h2>\n" + AtlasHtml(input);
  SCAN_TRY(const std::string cameras, CamerasHtml(input));
  html += "<h2>Cameras</h2>\n" + cameras + SolveHtml(input.poses->diagnostics);
  html += "<h2>Views</h2>\n";
  for (const auto& view : views) {
    if (!view) return tl::unexpected<Error>(view.error());
    html += *view;
  }
  html += "<h2>What the data determine</h2>\n" + FreeDirectionsList(*input.poses) +
          EstimatesTable(*input.poses);
  html += "<h2>Time</h2>\n" + StagesTable(input.stages) + "</body></html>\n";
  return WriteFileDurably(path, html);
}

}  // namespace scan
