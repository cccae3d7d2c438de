#include "reconstruction/pose/paper/paper_search.h"

#include <tbb/parallel_for.h>

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

struct Best {
  float cost = std::numeric_limits<float>::infinity();
  int angle_deg = 0;
};

// Ijiri 2018, Eq 4; rows run down, so a positive angle here is the paper's -alpha.
Best BestAngle(const PaperTemplate& t, const cv::Mat& distance, const Eigen::Vector2f& g_t,
               int angle_step_deg) {
  Best best;
  for (int angle = 0; angle < 360; angle += angle_step_deg) {
    const auto rad = static_cast<float>(RadFromDeg(angle));
    const float c = std::cos(rad), s = std::sin(rad);
    float sum = 0;
    int count = 0;
    for (const Eigen::Vector2f& p : t.boundary) {
      const int x = static_cast<int>(std::floor(c * p.x() - s * p.y() + g_t.x()));
      const int y = static_cast<int>(std::floor(s * p.x() + c * p.y() + g_t.y()));
      if (x < 0 || y < 0 || x >= distance.cols || y >= distance.rows) continue;
      sum += distance.ptr<float>(y)[x];
      ++count;
    }
    if (count == 0) continue;
    const float cost = sum / static_cast<float>(count);
    if (cost < best.cost) best = {cost, angle};
  }
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
    for (const cv::Point& p : boundary)
      t.boundary.push_back((Eigen::Vector2d(p.x + 0.5, p.y + 0.5) - origin).cast<float>());
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
  tbb::parallel_for(std::size_t{0}, templates.size(), [&](std::size_t i) {
    best[i] = BestAngle(templates[i], picture.distance_l1, target, angle_step_deg);
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
