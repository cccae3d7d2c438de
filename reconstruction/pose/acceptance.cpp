#include "reconstruction/pose/acceptance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace scan {

namespace {

// Every piece of the model's contour where the photograph would show it, each a little longer than
// it is, so that neighbours overlap.
ContourGrid ModelGrid(const ContourMesh& mesh, const ViewState& state) {
  std::vector<GridSegment> pieces;
  for (const ContourSample& s :
       FindContourSamples(mesh, state.camera_from_model, state.intrinsics, 1.0)) {
    const Eigen::Vector2d middle = s.pixel + state.mask_bias_px * s.normal;
    const Eigen::Vector2d half = s.half + 1.0 * s.half.normalized();
    pieces.push_back({middle - half, middle + half, s.normal, 0});
  }
  return ContourGrid(std::move(pieces), state.intrinsics.w, state.intrinsics.h);
}

// Where the specimen, or the gap beside it, is thinner than a pixel, the interpolated coverage need
// not pass one half: the photograph shows no outline there, or a shifted one. From one pixel on it
// does, where it should: pixels average over their square, interpolation spans two of them.
bool CanBeSeen(const ContourSample& sample, const ContourGrid& model, double mask_bias_px) {
  constexpr double kThinnestPx = 1.0;
  const Eigen::Vector2d at = sample.pixel + mask_bias_px * sample.normal;
  return !model.Nearest(at, -sample.normal, kThinnestPx, 0.5);
}

}  // namespace

Explained ExplainedShares(const ContourMesh& mesh, const PhotoContour& photo,
                          const ViewState& state, double tolerance_px, double spacing_px) {
  Explained explained;
  auto samples = FindContourSamples(mesh, state.camera_from_model, state.intrinsics, spacing_px);
  explained.sees_anything = !samples.empty();
  if (samples.empty() || photo.empty()) return explained;

  const ContourGrid grid = ModelGrid(mesh, state);
  std::erase_if(samples, [&](const ContourSample& sample) {
    return !CanBeSeen(sample, grid, state.mask_bias_px);
  });
  const MatchResult match = MatchContour(samples, photo, state.mask_bias_px, 3 * tolerance_px);
  double near_px = 0, squares = 0;
  for (const ContourMatch& m : match.matches) {
    if (std::abs(m.residual_px) > tolerance_px) continue;
    near_px += m.length_px;
    squares += m.length_px * m.residual_px * m.residual_px;
  }
  const double model_px = match.MatchedLength() + match.unmatched_px;
  explained.model_share = model_px > 0 ? near_px / model_px : 0;
  explained.rms_px = near_px > 0 ? std::sqrt(squares / near_px) : 0;

  std::size_t found = 0;
  for (const ContourPoint& p : photo.points)
    found += grid.Nearest(p.position, p.normal, tolerance_px, 0.5).has_value();
  explained.photo_share = static_cast<double>(found) / static_cast<double>(photo.points.size());
  return explained;
}

double TwoWayDistance(const ContourMesh& mesh, const PhotoContour& photo, const ViewState& state,
                      double clip_px, double spacing_px) {
  const auto samples =
      FindContourSamples(mesh, state.camera_from_model, state.intrinsics, spacing_px);
  if (samples.empty() || photo.empty()) return clip_px;
  const MatchResult match = MatchContour(samples, photo, state.mask_bias_px, clip_px);
  double model = clip_px * match.unmatched_px;
  for (const ContourMatch& m : match.matches) model += m.length_px * std::abs(m.residual_px);
  const double length = match.unmatched_px + match.MatchedLength();
  const ContourGrid grid = ModelGrid(mesh, state);
  const std::size_t stride =
      std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(spacing_px / 2)));
  double back = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < photo.points.size(); i += stride, ++count) {
    const ContourPoint& p = photo.points[i];
    const auto crossing = grid.Nearest(p.position, p.normal, clip_px, 0.5);
    back += crossing ? std::abs(crossing->distance_px) : clip_px;
  }
  return 0.5 * (length > 0 ? model / length : clip_px) + 0.5 * back / static_cast<double>(count);
}

double Misfit(const ContourMesh& mesh, const PhotoContour& photo, const ViewState& state,
              double sigma_px, double correlation_px, double spacing_px) {
  constexpr double kClipSigmas = 10;
  constexpr double kPointPx = 2;  // between points of the photo's contour
  const double clip_px = kClipSigmas * sigma_px;
  const auto samples =
      FindContourSamples(mesh, state.camera_from_model, state.intrinsics, spacing_px);
  const double all = 0.5 * photo.length_px / correlation_px * kClipSigmas * kClipSigmas;
  if (samples.empty() || photo.empty()) return all;
  const auto squared = [&](double distance_px) {
    const double u = distance_px / sigma_px;
    return u * u;
  };
  const MatchResult match = MatchContour(samples, photo, state.mask_bias_px, clip_px);
  double model = match.unmatched_px * kClipSigmas * kClipSigmas;
  for (const ContourMatch& m : match.matches) model += m.length_px * squared(m.residual_px);
  const ContourGrid grid = ModelGrid(mesh, state);
  double back = 0;
  for (const ContourPoint& p : photo.points) {
    const auto crossing = grid.Nearest(p.position, p.normal, clip_px, 0.5);
    back += kPointPx * (crossing ? squared(crossing->distance_px) : kClipSigmas * kClipSigmas);
  }
  return 0.5 * 0.5 * (model + back) / correlation_px;
}

std::string RejectionReason(const Explained& explained, double view_prior_chi2,
                            const AcceptanceOptions& options) {
  if (!explained.sees_anything)
    return "the specimen's surface falls outside of the picture: wrong pose or wrong photograph";
  if (explained.photo_share < options.explained)
    return fmt::format(
        "only {:.0f} % of the photograph's outline lies on the model's: the mask shows something "
        "else, or the specimen moved or changed",
        100 * explained.photo_share);
  if (explained.model_share < options.explained)
    return fmt::format(
        "only {:.0f} % of the model's outline is seen in the photograph: a part is missing in the "
        "mask, hidden, or moved",
        100 * explained.model_share);
  if (view_prior_chi2 > options.prior_chi2)
    return fmt::format(
        "the outline fits only at a pose that the log makes improbable (chi-square {:.0f} of 8): "
        "lost steps, or the specimen moved",
        view_prior_chi2);
  return {};
}

}  // namespace scan
