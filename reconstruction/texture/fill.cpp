#include "reconstruction/texture/fill.h"

#include <tbb/parallel_for.h>

#include <opencv2/imgproc.hpp>

#include "reconstruction/texture/texture.h"

namespace scan {
namespace {

// The mean of the neighbours for which `known` holds; false when there is none.
template <class Known>
bool MeanOfNeighbours(const Texels& texels, const std::vector<cv::Vec3f>& colour, std::size_t i,
                      Known&& known, cv::Vec3f& mean) {
  cv::Vec3f sum(0, 0, 0);
  int count = 0;
  texels.VisitNeighbours(i, [&](std::int32_t j) {
    if (!known(j)) return;
    sum += colour[j];
    ++count;
  });
  if (count) mean = sum * (1.f / static_cast<float>(count));
  return count > 0;
}

}  // namespace

void FillUnseen(const Texels& texels, int smoothing_steps, Layer& result) {
  const std::size_t count = texels.size();
  std::vector<cv::Vec3f> colour(count);
  std::vector<std::uint8_t> known(count);
  std::vector<std::size_t> unseen, front, next;
  cv::Vec3d sum(0, 0, 0);
  double area = 0;
  for (std::size_t i = 0; i < count; ++i) {
    known[i] = result.view[i] != kNoView;
    if (!known[i]) {
      unseen.push_back(i);
      continue;
    }
    colour[i] = LinearOfCodes(result.colour[i]);
    sum += static_cast<cv::Vec3d>(colour[i]) * texels.area_mm2[i];
    area += texels.area_mm2[i];
  }
  const cv::Vec3f mean = area > 0 ? cv::Vec3f(sum * (1 / area)) : cv::Vec3f(0, 0, 0);
  auto touches_known = [&](std::size_t i) {
    bool touches = false;
    texels.VisitNeighbours(i, [&](std::int32_t j) { touches |= known[j] != 0; });
    return touches;
  };
  for (const std::size_t i : unseen) {
    if (touches_known(i)) front.push_back(i);
  }
  std::vector<std::uint8_t> reached = known, queued = known;
  for (const std::size_t i : front) queued[i] = 1;
  while (!front.empty()) {  // one ring of texels at a time
    for (const std::size_t i : front) {
      MeanOfNeighbours(
          texels, colour, i, [&](std::int32_t j) { return reached[j] != 0; }, colour[i]);
    }
    next.clear();
    for (const std::size_t i : front) reached[i] = 1;
    for (const std::size_t i : front) {
      texels.VisitNeighbours(i, [&](std::int32_t j) {
        if (queued[j]) return;
        queued[j] = 1;
        next.push_back(j);
      });
    }
    front.swap(next);
  }
  for (const std::size_t i : unseen) {
    if (!reached[i]) colour[i] = mean;
  }
  std::vector<cv::Vec3f> smoothed(unseen.size());
  for (int step = 0; step < smoothing_steps; ++step) {
    tbb::parallel_for(std::size_t{0}, unseen.size(), [&](std::size_t k) {
      smoothed[k] = colour[unseen[k]];
      MeanOfNeighbours(
          texels, colour, unseen[k], [](std::int32_t) { return true; }, smoothed[k]);
    });
    for (std::size_t k = 0; k < unseen.size(); ++k) colour[unseen[k]] = smoothed[k];
  }
  for (const std::size_t i : unseen) {
    result.colour[i] = CodesOfLinear(colour[i]);
    result.kind[i] = static_cast<std::uint16_t>(TexelClass::filled);
  }
}

void PadGutters(const Texels& texels, cv::Mat& albedo) {
  cv::Mat outside(albedo.size(), CV_8U, cv::Scalar(255));
  for (const std::int32_t place : texels.place) outside.data[place] = 0;
  cv::Mat distance, nearest;
  cv::distanceTransform(outside, distance, nearest, cv::DIST_L2, cv::DIST_MASK_5,
                        cv::DIST_LABEL_PIXEL);
  std::vector<cv::Vec3b> colour(texels.size() + 1);
  for (const std::int32_t place : texels.place) {
    colour[nearest.ptr<int>()[place]] = albedo.ptr<cv::Vec3b>()[place];
  }
  for (std::size_t i = 0; i < albedo.total(); ++i) {
    if (outside.data[i]) albedo.ptr<cv::Vec3b>()[i] = colour[nearest.ptr<int>()[i]];
  }
}

}  // namespace scan
