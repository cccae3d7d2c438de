#include "reconstruction/pose/paper/paper_search.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "drivers/base/units.h"
#include "reconstruction/pose/silhouette_raster.h"

namespace scan {
namespace {

// Of the covered pixels, about the principal point.
Eigen::Vector2d CentroidOf(const cv::Mat& mask, const Intrinsics& in) {
  const cv::Moments m = cv::moments(mask, true);
  return Eigen::Vector2d(m.m10 / m.m00 + 0.5, m.m01 / m.m00 + 0.5) - Eigen::Vector2d(in.cx, in.cy);
}

constexpr std::size_t kStride = 16;  // of the order in which boundary points are looked at

struct Best {
  float cost = std::numeric_limits<float>::infinity();
  int angle_deg = 0;
};

// The least cost of any template so far. Whatever is above it can be given up half way without
// changing the minimum, nor which template has it: only what is strictly worse is given up.
class LeastCost {
 public:
  float value() const { return value_.load(std::memory_order_relaxed); }
  void Lower(float cost) {
    float before = value();
    while (cost < before && !value_.compare_exchange_weak(before, cost)) {
    }
  }

 private:
  std::atomic<float> value_{std::numeric_limits<float>::infinity()};
};

// Ijiri 2018, Eq 4; rows run down, so a positive angle here is the paper's -alpha.
// The mean over the points inside is at least the sum so far over all points, so that once this
// exceeds the least cost known the angle cannot win.
Best BestAngle(const PaperTemplate& t, const cv::Mat& distance, const Eigen::Vector2f& g_t,
               int angle_step_deg, LeastCost& least) {
  constexpr std::size_t kBetweenChecks = 16;
  Best best;
  const auto total = static_cast<float>(t.boundary.size());
  const auto width = static_cast<float>(distance.cols), height = static_cast<float>(distance.rows);
  for (int angle = 0; angle < 360; angle += angle_step_deg) {
    const auto rad = static_cast<float>(RadFromDeg(angle));
    const float c = std::cos(rad), s = std::sin(rad);
    // A little above, for the rounding of the sums.
    const float given_up = 1.0001f * std::min(best.cost, least.value()) * total;
    float sum = 0;
    int count = 0;
    bool worse = false;
    for (std::size_t i = 0; i < t.boundary.size() && !worse;) {
      const std::size_t end = std::min(i + kBetweenChecks, t.boundary.size());
      for (; i < end; ++i) {
        const Eigen::Vector2f& p = t.boundary[i];
        const float x = c * p.x() - s * p.y() + g_t.x(), y = s * p.x() + c * p.y() + g_t.y();
        if (!(x >= 0 && y >= 0 && x < width && y < height)) continue;
        sum += distance.ptr<float>(static_cast<int>(y))[static_cast<int>(x)];
        ++count;
      }
      worse = sum > given_up;
    }
    if (worse || count == 0) continue;
    const float cost = sum / static_cast<float>(count);
    if (cost < best.cost) best = {cost, angle};
  }
  least.Lower(best.cost);
  return best;
}

}  // namespace

std::vector<PaperTemplate> RenderTemplates(const TriangleMesh& mesh,
                                           const Eigen::Vector3d& mass_centre,
                                           const std::vector<Eigen::Vector3d>& directions,
                                           const std::vector<double>& distances_mm,
                                           const Intrinsics& reduced) {
  std::vector<PaperTemplate> all(directions.size() * distances_mm.size());
  tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t i) {
    PaperTemplate& t = all[i];
    t.camera = LookFrom(directions[i / distances_mm.size()], distances_mm[i % distances_mm.size()]);
    const cv::Mat mask = RenderReduced(mesh, CameraFromModelOf(t.camera, mass_centre), reduced);
    const std::vector<cv::Point> boundary = BoundaryPixels(mask);
    if (boundary.empty()) return;
    t.centroid = CentroidOf(mask, reduced);
    const Eigen::Vector2d origin = t.centroid + Eigen::Vector2d(reduced.cx, reduced.cy);
    t.boundary.reserve(boundary.size());
    // Every sixteenth first, then the next ones: any beginning of the list stands for the whole.
    for (std::size_t first = 0; first < std::min(kStride, boundary.size()); ++first)
      for (std::size_t k = first; k < boundary.size(); k += kStride)
        t.boundary.push_back(
            (Eigen::Vector2d(boundary[k].x + 0.5, boundary[k].y + 0.5) - origin).cast<float>());
  });
  std::erase_if(all, [](const PaperTemplate& t) { return t.boundary.empty(); });
  return all;
}

PaperStart SearchTemplates(const std::vector<PaperTemplate>& templates,
                           const ReducedPicture& picture, int angle_step_deg) {
  const Intrinsics& in = picture.intrinsics;
  const Eigen::Vector2d g_t = CentroidOf(picture.mask, in);
  const Eigen::Vector2f target = (g_t + Eigen::Vector2d(in.cx, in.cy)).cast<float>();
  std::vector<Best> best(templates.size());
  LeastCost least;
  tbb::parallel_for(std::size_t{0}, templates.size(), [&](std::size_t i) {
    best[i] = BestAngle(templates[i], picture.distance_l1, target, angle_step_deg, least);
  });
  PaperStart start;
  start.cost_px = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < templates.size(); ++i) {
    if (!(best[i].cost < start.cost_px)) continue;
    start.cost_px = best[i].cost;
    start.camera = templates[i].camera;
    // Ijiri 2018, Eq 5, with the signs of alpha and delta_z flipped for rows that run down.
    const double angle = RadFromDeg(best[i].angle_deg);
    const Eigen::Vector2d g_r = Eigen::Rotation2Dd(angle) * templates[i].centroid;
    start.camera.delta_x = angle;
    start.camera.delta_y = std::atan((g_t.x() - g_r.x()) / in.fl_x);
    start.camera.delta_z = -std::atan((g_t.y() - g_r.y()) / in.fl_y);
  }
  return start;
}

}  // namespace scan
