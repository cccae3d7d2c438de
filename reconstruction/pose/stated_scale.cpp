#include "reconstruction/pose/stated_scale.h"

#include <fmt/format.h>

#include <cmath>

#include "reconstruction/pose/joint_result.h"
#include "reconstruction/pose/outline_distance.h"

namespace scan {

std::string RefutedScale(const ContourMesh& mesh, RigModel rig,
                         std::span<const PhotoContour> photos, const std::vector<bool>& views,
                         const RigParameters& start, const RefineOptions& options,
                         std::stop_token stop) {
  constexpr double kFree = 0.5;     // prior of the scale's logarithm when it is free
  constexpr double kSigmas = 3.29;  // 99.9 %
  const double stated_sigma = rig.priors().ct_scale_rel;
  rig.set_ct_scale_sigma(kFree);
  const RefineResult free = RefineJoint(mesh, rig, photos, views, start, options, stop);
  if (stop.stop_requested() ||
      MeanOutlineDistance(mesh, rig, free.parameters, photos, views, 1.5 * options.last_window_px,
                          options.spacing_px) > kExplainedPx * UnitPx(options))
    return {};
  const RigPosterior posterior = PosteriorOf(rig, free);
  const int at = posterior.layout.ct_scale();
  const double sigma = std::hypot(stated_sigma, std::sqrt(posterior.covariance(at, at)));
  const double log_scale = free.parameters.log_ct_scale;
  if (std::abs(log_scale) <= kSigmas * sigma) return {};
  return fmt::format(
      "the outlines fit a model of {:.3g} times the mesh's size (sigma {:.2g}): the mesh is not in "
      "mm or of another specimen, or the station's distance or focal length is wrong",
      std::exp(log_scale), sigma);
}

}  // namespace scan
