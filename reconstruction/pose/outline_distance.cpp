#include "reconstruction/pose/outline_distance.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "reconstruction/pose/acceptance.h"

namespace scan {

double MeanOutlineDistance(const ContourMesh& mesh, const RigModel& rig,
                           const RigParameters& parameters, std::span<const PhotoContour> photos,
                           const std::vector<bool>& use, double clip_px, double spacing_px) {
  std::vector<double> distance(photos.size(), 0);
  tbb::parallel_for(std::size_t{0}, photos.size(), [&](std::size_t i) {
    if (!use[i]) return;
    const ViewState state{rig.CameraFromModelOf(parameters, static_cast<int>(i)),
                          rig.IntrinsicsOf(parameters, rig.views()[i].lens),
                          parameters.mask_bias_px};
    distance[i] = TwoWayDistance(mesh, photos[i], state, clip_px, spacing_px);
  });
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    sum += distance[i];
    count += use[i] ? 1 : 0;
  }
  return sum / std::max(1.0, count);
}

}  // namespace scan
