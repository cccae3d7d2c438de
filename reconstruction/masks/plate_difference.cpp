#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "reconstruction/masks/segmentation.h"

namespace scan {
namespace {

double LinearOfCode(double code) {
  const double c = code / 255;
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

double CodeOfLinear(double linear) {
  const double c = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
  return 255 * c;
}

std::array<float, 256> LinearTable() {
  std::array<float, 256> table;
  for (int i = 0; i < 256; ++i) table[i] = static_cast<float>(LinearOfCode(i));
  return table;
}

float Median(std::vector<float>& values) {
  auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Visits a subsample of the picture's rim, where the background shows.
template <class Visit>
void VisitRim(cv::Size size, const cv::Mat& ignore, Visit&& visit) {
  const int rim = std::max(4, std::min(size.width, size.height) / 16);
  for (int y = 0; y < size.height; y += 2) {
    const bool full_row = y < rim || y >= size.height - rim;
    for (int x = 0; x < size.width; x += 2) {
      if (!full_row && x == rim + rim % 2) x = (size.width - rim) & ~1;
      if (ignore.empty() || !ignore.at<uchar>(y, x)) visit(y, x);
    }
  }
}

constexpr int kBins = 8;  // of the plate's code: noise grows with light

struct NoiseModel {
  std::array<std::array<float, 256>, 3> plate_code;  // the plate at the photograph's exposure
  std::array<std::array<float, 256>, 3> plate_linear;
  std::array<std::array<float, 256>, 3> sigma;  // sRGB codes, by the plate's code
};

// Per channel: exposure as the median ratio in linear light, then the spread of the remaining
// difference (1.4826 median absolute deviations) in eight ranges of the plate's code.
NoiseModel FitNoise(const cv::Mat& photo, const cv::Mat& plate, const cv::Mat& ignore,
                    double noise_floor) {
  const std::array<float, 256> linear = LinearTable();
  NoiseModel model;
  for (int c = 0; c < 3; ++c) {
    std::vector<float> ratios;
    VisitRim(photo.size(), ignore, [&](int y, int x) {
      const float p = linear[photo.at<cv::Vec3b>(y, x)[c]],
                  b = linear[plate.at<cv::Vec3b>(y, x)[c]];
      if (b > 0.02f && b < 0.98f && p < 0.98f) ratios.push_back(p / b);
    });
    const double gain = ratios.size() < 200 ? 1.0 : std::clamp<double>(Median(ratios), 0.25, 4.0);
    for (int i = 0; i < 256; ++i) {
      const double exposed = std::min(1.0, gain * LinearOfCode(i));
      model.plate_linear[c][i] = static_cast<float>(exposed);
      model.plate_code[c][i] = static_cast<float>(CodeOfLinear(exposed));
    }
    std::array<std::vector<float>, kBins> deviations;
    std::vector<float> all;
    VisitRim(photo.size(), ignore, [&](int y, int x) {
      const int b = plate.at<cv::Vec3b>(y, x)[c];
      const float d = std::abs(photo.at<cv::Vec3b>(y, x)[c] - model.plate_code[c][b]);
      deviations[b * kBins / 256].push_back(d);
      all.push_back(d);
    });
    const float overall = all.empty() ? 0 : 1.4826f * Median(all);
    for (int bin = 0; bin < kBins; ++bin) {
      const float spread =
          deviations[bin].size() < 300 ? overall : 1.4826f * Median(deviations[bin]);
      const int width = 256 / kBins;
      std::fill_n(model.sigma[c].begin() + bin * width, width,
                  std::max(static_cast<float>(noise_floor), spread));
    }
  }
  return model;
}

}  // namespace

cv::Mat LinearOf(const cv::Mat& srgb) {
  static constexpr int kChannels = 3;
  const std::array<float, 256> table = LinearTable();
  cv::Mat linear(srgb.size(), CV_32FC3);
  for (int y = 0; y < srgb.rows; ++y) {
    const uchar* in = srgb.ptr<uchar>(y);
    float* out = linear.ptr<float>(y);
    for (int i = 0; i < kChannels * srgb.cols; ++i) out[i] = table[in[i]];
  }
  return linear;
}

Difference DifferenceToPlate(const cv::Mat& photo, const cv::Mat& plate, const cv::Mat& ignore,
                             double noise_floor) {
  const NoiseModel noise = FitNoise(photo, plate, ignore, noise_floor);
  Difference out;
  out.normalised.create(photo.size(), CV_32FC3);
  out.evidence.create(photo.size(), CV_32F);
  out.plate_linear.create(photo.size(), CV_32FC3);
  for (int y = 0; y < photo.rows; ++y) {
    const auto* p = photo.ptr<cv::Vec3b>(y);
    const auto* b = plate.ptr<cv::Vec3b>(y);
    for (int x = 0; x < photo.cols; ++x) {
      // Specimen: any colour alike, density 1 / 256^3. Background: Gaussian around the plate.
      double squares = 0, volume = 1;
      for (int c = 0; c < 3; ++c) {
        const uchar code = b[x][c];
        const float sigma = noise.sigma[c][code];
        const float d = (p[x][c] - noise.plate_code[c][code]) / sigma;
        out.normalised.at<cv::Vec3f>(y, x)[c] = std::clamp(d, -50.f, 50.f);
        out.plate_linear.at<cv::Vec3f>(y, x)[c] = noise.plate_linear[c][code];
        squares += d * d;
        volume *= sigma;
      }
      constexpr double kLogCells = 16.6355323 - 2.7568156;  // ln 256^3 - 1.5 ln 2 pi
      const bool skip = !ignore.empty() && ignore.at<uchar>(y, x);
      out.evidence.at<float>(y, x) =
          skip ? 0.f
               : static_cast<float>(std::min(0.5 * squares, 60.0) - kLogCells + std::log(volume));
    }
  }
  return out;
}

}  // namespace scan
