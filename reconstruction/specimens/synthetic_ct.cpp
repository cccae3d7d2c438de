#include "reconstruction/specimens/synthetic_ct.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

#include "drivers/base/rng.h"

namespace scan {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kBlock = 8;

Volume EmptyVolume(const Specimen& specimen, const CtOptions& options) {
  const BoundingBox box = specimen.Bounds();
  Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (int c = 0; c < 8; ++c) {
    const Vector3d corner(c & 1 ? box.high.x() : box.low.x(), c & 2 ? box.high.y() : box.low.y(),
                          c & 4 ? box.high.z() : box.low.z());
    const Vector3d q = options.direction.transpose() * corner;
    low = low.cwiseMin(q);
    high = high.cwiseMax(q);
  }
  low.array() -= options.margin_mm;
  high.array() += options.margin_mm;
  const double voxel =
      options.voxel_mm > 0 ? options.voxel_mm : (high - low).maxCoeff() / options.longest_side;
  Volume volume;
  volume.spacing_mm.setConstant(voxel);
  volume.direction = options.direction;
  for (int a = 0; a < 3; ++a) {
    const double voxels = std::ceil((high - low)[a] / voxel - 1e-9);
    volume.size[static_cast<std::size_t>(a)] = static_cast<std::size_t>(voxels);
  }
  volume.origin_mm = options.direction * (low + Vector3d::Constant(0.5 * voxel));
  volume.grey.assign(volume.voxels(), 0);
  return volume;
}

Vector3d CentreOf(const Volume& v, double i, double j, double k) {
  return v.origin_mm + v.direction * v.spacing_mm.cwiseProduct(Vector3d(i, j, k));
}

double VoxelDensity(const Specimen& specimen, const CtOptions& options, const Volume& volume,
                    const Vector3d& centre) {
  const double voxel = volume.spacing_mm.x();
  const double d = specimen.SignedDistance(centre);
  const double reach = 0.5 * std::sqrt(3.0) * voxel;
  if (d > reach) return 0;
  double density = 0;
  if (d < -2 * reach) {
    density = specimen.Density(centre);
  } else {
    const int n = options.supersampling;
    for (int s = 0; s < n * n * n; ++s) {
      const Vector3d at(s % n, s / n % n, s / n / n);
      const Vector3d offset = voxel * ((at.array() + 0.5) / n - 0.5).matrix();
      density += specimen.Density(centre + volume.direction * offset);
    }
    density /= n * n * n;
  }
  const double depth = std::clamp(-d / 5.0, 0.0, 1.0);
  return density * (1 - options.beam_hardening * depth);
}

void FillDensity(const Specimen& specimen, const CtOptions& options, Volume& volume) {
  const auto blocks = [&](std::size_t a) { return (volume.size[a] + kBlock - 1) / kBlock; };
  const std::size_t nx = blocks(0), ny = blocks(1), nz = blocks(2);
  const double half = 0.5 * (kBlock - 1);
  const double reach = std::sqrt(3.0) * (half + 0.5) * volume.spacing_mm.x();
  tbb::parallel_for(std::size_t{0}, nx * ny * nz, [&](std::size_t b) {
    const std::size_t i0 = b % nx * kBlock, j0 = b / nx % ny * kBlock, k0 = b / nx / ny * kBlock;
    const auto at = [](std::size_t v) { return static_cast<double>(v); };
    if (specimen.SignedDistance(CentreOf(volume, at(i0) + half, at(j0) + half, at(k0) + half)) >
        reach) {
      return;
    }
    for (std::size_t k = k0; k < std::min(k0 + kBlock, volume.size[2]); ++k) {
      for (std::size_t j = j0; j < std::min(j0 + kBlock, volume.size[1]); ++j) {
        for (std::size_t i = i0; i < std::min(i0 + kBlock, volume.size[0]); ++i) {
          volume.grey[volume.index(i, j, k)] = static_cast<float>(
              VoxelDensity(specimen, options, volume, CentreOf(volume, at(i), at(j), at(k))));
        }
      }
    }
  });
}

std::vector<float> GaussianWeights(double sigma) {
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  std::vector<float> weights;
  float sum = 0;
  for (int k = -radius; k <= radius; ++k) {
    weights.push_back(static_cast<float>(std::exp(-0.5 * k * k / (sigma * sigma))));
    sum += weights.back();
  }
  for (float& w : weights) w /= sum;
  return weights;
}

// Along one axis; the outermost voxels continue beyond the volume.
void BlurAlong(Volume& volume, std::size_t axis, const std::vector<float>& weights) {
  const std::array<std::size_t, 3> stride{1, volume.size[0], volume.size[0] * volume.size[1]};
  const std::size_t u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
  const auto n = static_cast<std::ptrdiff_t>(volume.size[axis]);
  const auto radius = static_cast<std::ptrdiff_t>(weights.size() / 2);
  // Planes of lines: neighbouring lines share cache lines.
  tbb::parallel_for(std::size_t{0}, volume.size[v], [&](std::size_t y) {
    std::vector<float> line(static_cast<std::size_t>(n + 2 * radius));
    for (std::size_t x = 0; x < volume.size[u]; ++x) {
      float* first = volume.grey.data() + x * stride[u] + y * stride[v];
      for (std::ptrdiff_t k = 0; k < n + 2 * radius; ++k) {
        const std::ptrdiff_t from = std::clamp<std::ptrdiff_t>(k - radius, 0, n - 1);
        line[static_cast<std::size_t>(k)] = first[static_cast<std::size_t>(from) * stride[axis]];
      }
      for (std::ptrdiff_t k = 0; k < n; ++k) {
        float sum = 0;
        for (std::size_t w = 0; w < weights.size(); ++w) {
          sum += weights[w] * line[static_cast<std::size_t>(k) + w];
        }
        first[static_cast<std::size_t>(k) * stride[axis]] = sum;
      }
    }
  });
}

// About normal: the sum of four 16-bit uniform numbers, scaled to variance 1.
double NoiseOf(std::uint64_t bits) {
  double sum = 0;
  for (int k = 0; k < 4; ++k) sum += static_cast<double>(bits >> (16 * k) & 0xffff);
  return (sum / 65536.0 - 2.0 + 2.0 / 65536.0) * std::sqrt(3.0);
}

void ToGrey(const CtOptions& options, Volume& volume) {
  const double ci = 0.5 * static_cast<double>(volume.size[0] - 1);
  const double cj = 0.5 * static_cast<double>(volume.size[1] - 1);
  std::vector<double> rings(static_cast<std::size_t>(std::hypot(ci, cj)) + 3);
  Rng ring_rng(options.seed ^ 0x72696e67);
  for (double& ring : rings) ring = options.ring_grey * ring_rng.Normal();
  tbb::parallel_for(std::size_t{0}, volume.size[2], [&](std::size_t k) {
    // Seeded per slice, so that the slices may be done in any order.
    Rng rng(options.seed * 0x9e3779b97f4a7c15ULL + k);
    for (std::size_t j = 0; j < volume.size[1]; ++j) {
      for (std::size_t i = 0; i < volume.size[0]; ++i) {
        float& value = volume.grey[volume.index(i, j, k)];
        double grey = options.air_grey + (options.dense_grey - options.air_grey) * value;
        grey += options.noise_sigma_grey * NoiseOf(rng.Next());
        if (options.ring_grey != 0) {
          const double r = std::hypot(static_cast<double>(i) - ci, static_cast<double>(j) - cj);
          const auto inner = static_cast<std::size_t>(r);
          const double t = r - static_cast<double>(inner);
          grey += (1 - t) * rings[inner] + t * rings[inner + 1];
        }
        value = static_cast<float>(std::clamp(std::round(grey), 0.0, 65535.0));
      }
    }
  });
}

}  // namespace

Volume SynthesiseCt(const Specimen& specimen, const CtOptions& options) {
  assert(options.voxel_mm >= 0 && options.longest_side >= 8 && options.supersampling >= 1);
  Volume volume = EmptyVolume(specimen, options);
  FillDensity(specimen, options, volume);
  if (options.blur_voxels > 0) {
    const std::vector<float> weights = GaussianWeights(options.blur_voxels);
    for (std::size_t axis = 0; axis < 3; ++axis) BlurAlong(volume, axis, weights);
  }
  ToGrey(options, volume);
  return volume;
}

}  // namespace scan
