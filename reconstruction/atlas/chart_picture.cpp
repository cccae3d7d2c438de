#include "reconstruction/atlas/chart_picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "reconstruction/render/shade.h"

namespace scan {
namespace {

// Hues by the golden section: neighbours in number lie far apart.
Eigen::Vector3f ColourOf(std::uint32_t chart) {
  const double hue = 6 * std::fmod(0.618033988749895 * chart, 1.0);
  const double bright = chart % 3 == 0 ? 0.75 : (chart % 3 == 1 ? 0.55 : 0.4);
  const auto channel = [&](double at) {
    const double ramp = std::clamp(std::abs(std::fmod(hue + at, 6.0) - 3) - 1, 0.0, 1.0);
    return static_cast<float>(bright * (0.3 + 0.7 * ramp));
  };
  return {channel(0), channel(4), channel(2)};
}

cv::Scalar Shown(const Eigen::Vector3f& linear) {
  const auto srgb = [](float c) { return 255 * std::pow(c, 1 / 2.2f); };
  return {srgb(linear[2]), srgb(linear[1]), srgb(linear[0])};
}

}  // namespace

cv::Mat ChartPicture(const AtlasMesh& atlas, int height_px) {
  std::vector<Eigen::Vector3f> colour;
  for (const std::uint32_t chart : atlas.chart) colour.push_back(ColourOf(chart));
  ShadeOptions options;
  options.height_px = height_px;
  const cv::Mat surface = ShadedPicture(atlas.mesh, colour, options);
  constexpr int kFine = 4;
  const double size = kFine * height_px;
  cv::Mat square(kFine * height_px, kFine * height_px, CV_8UC3, cv::Scalar(235, 235, 235)), small;
  for (std::size_t f = 0; f < atlas.mesh.faces.size(); ++f) {
    std::vector<cv::Point> corners;
    for (const std::uint32_t v : atlas.mesh.faces[f])
      corners.emplace_back(static_cast<int>(atlas.uv[v].x() * size),
                           static_cast<int>(atlas.uv[v].y() * size));
    cv::fillConvexPoly(square, corners, Shown(colour[f]));
  }
  cv::resize(square, small, {height_px, height_px}, 0, 0, cv::INTER_AREA);
  cv::Mat picture;
  cv::hconcat(surface, small, picture);
  return picture;
}

}  // namespace scan
