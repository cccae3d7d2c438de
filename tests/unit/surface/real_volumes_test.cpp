// The whole path on real scans; skipped where they are absent.
#include <gtest/gtest.h>

#include <zlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <numeric>

#include "reconstruction/mesh/mesh_io.h"
#include "reconstruction/surface/surface.h"
#include "reconstruction/volume/read_volume.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

const fs::path kData = fs::path(SCAN_SOURCE_DIR) / "../shared/data";

#define SKIP_WITHOUT(path) \
  if (!fs::exists(path)) GTEST_SKIP() << "needs " << (path).string()

double Mean(const Volume& v) {
  return std::accumulate(v.grey.begin(), v.grey.end(), 0.0) / static_cast<double>(v.grey.size());
}
std::ptrdiff_t CountFrom(const Volume& v, float threshold) {
  return std::count_if(v.grey.begin(), v.grey.end(), [&](float g) { return g >= threshold; });
}
ReadVolumeOptions Voxel(double mm) { return {.voxel_mm = Eigen::Vector3d::Constant(mm)}; }

// Grey value at a point of the model frame, trilinear.
double GreyAt(const Volume& v, const Eigen::Vector3d& p) {
  const Eigen::Vector3d at =
      (v.direction.transpose() * (p - v.origin_mm)).cwiseQuotient(v.spacing_mm);
  std::size_t low[3];
  double t[3];
  for (int a = 0; a < 3; ++a) {
    const double c = std::clamp(at[a], 0.0, static_cast<double>(v.size[a]) - 1.001);
    low[a] = static_cast<std::size_t>(c);
    t[a] = c - static_cast<double>(low[a]);
  }
  double sum = 0;
  for (int n = 0; n < 8; ++n)
    sum += (n & 1 ? t[0] : 1 - t[0]) * (n & 2 ? t[1] : 1 - t[1]) * (n & 4 ? t[2] : 1 - t[2]) *
           v.grey[v.index(low[0] + (n & 1), low[1] + (n >> 1 & 1), low[2] + (n >> 2))];
  return sum;
}

TEST(RealVolumes, AntInItsTubeWithoutAThreshold) {
  const fs::path path = kData / "ant_microct/slices";
  SKIP_WITHOUT(path);
  const auto volume = ReadVolume(path, Voxel(0.0244));
  ASSERT_TRUE(volume) << ToString(volume.error());
  EXPECT_EQ(volume->size, (std::array<std::size_t, 3>{202, 202, 307}));
  EXPECT_NEAR(Mean(*volume), 52.323, 1e-3);
  EXPECT_EQ(CountFrom(*volume, 100), 170646);
  const auto result = ExtractSurface(*volume);
  ASSERT_TRUE(result) << ToString(result.error());
  EXPECT_TRUE(result->topology.closed_manifold());
  // One piece; with its inner spaces open to the outside it had 9 and an Euler number of -1260.
  EXPECT_EQ(result->topology.components, 1u);
  EXPECT_GE(result->topology.euler, -4);
  // The fluid is at 50 to 80, the cuticle from 100 on.
  EXPECT_GT(result->segmentation.threshold, 82);
  EXPECT_LT(result->segmentation.threshold, 105);
  // Neither the tube (203 voxels wide) nor the gut alone (40): the ant, legs and all.
  const BoundingBox box = BoundsOf(result->mesh);
  const Eigen::Vector3d voxels = (box.high - box.low) / 0.0244;
  EXPECT_GT(voxels.minCoeff(), 100);
  EXPECT_LT(voxels.x(), 190);
  EXPECT_LT(voxels.y(), 190);
  EXPECT_GT(voxels.z(), 180);
  EXPECT_LT(voxels.z(), 260);
}

TEST(RealVolumes, BoneBlockIsClosedAtItsBorder) {
  const fs::path path = kData / "bone_microct/bone_128x128x128.tif";
  SKIP_WITHOUT(path);
  const auto volume = ReadVolume(path, Voxel(1));
  ASSERT_TRUE(volume) << ToString(volume.error());
  EXPECT_NEAR(Mean(*volume), 116.1145, 1e-3);
  EXPECT_EQ(CountFrom(*volume, 128), 978055);
  SurfaceOptions options;
  options.smoothing_iterations = 0;
  const auto result = ExtractSurface(*volume, options);
  ASSERT_TRUE(result) << ToString(result.error());
  EXPECT_TRUE(result->topology.closed_manifold());
  const BoundingBox box = BoundsOf(result->mesh);
  EXPECT_LT((box.low - Eigen::Vector3d::Constant(-0.5)).norm(), 1e-3);
  EXPECT_LT((box.high - Eigen::Vector3d::Constant(127.5)).norm(), 1e-3);
}

TEST(RealVolumes, ForamShell) {
  const fs::path path = kData / "foram_shell_microct/shell_225x128x128.tif";
  SKIP_WITHOUT(path);
  const auto volume = ReadVolume(path, Voxel(1));
  ASSERT_TRUE(volume) << ToString(volume.error());
  EXPECT_EQ(volume->size, (std::array<std::size_t, 3>{128, 128, 225}));
  EXPECT_NEAR(Mean(*volume), 14.8052, 1e-3);
  SegmentOptions options;
  options.threshold = 80;
  options.exterior.leak_radius = 0;
  const auto s = Segment(*volume, options);
  ASSERT_TRUE(s) << ToString(s.error());
  EXPECT_EQ(s->voxels_above, 383467u);
  EXPECT_LE(s->cavity_voxels, 1043u);  // all enclosed air of that threshold
  EXPECT_GT(s->cavity_voxels, 900u);
  const auto result = ExtractSurface(*volume);
  ASSERT_TRUE(result) << ToString(result.error());
  EXPECT_TRUE(result->topology.closed_manifold());
}

TEST(RealVolumes, BonsaiNifti) {
  const fs::path path = kData / "scivis_ct/bonsai.nii.gz";
  SKIP_WITHOUT(path);
  const auto volume = ReadVolume(path);
  ASSERT_TRUE(volume) << ToString(volume.error());
  EXPECT_EQ(volume->size, (std::array<std::size_t, 3>{256, 256, 256}));
  EXPECT_NEAR(Mean(*volume), 13.4648, 1e-3);
  EXPECT_EQ(CountFrom(*volume, 30), 1888421);
  EXPECT_EQ(CountFrom(*volume, 60), 1228056);
}

Volume ReadHead(const fs::path& folder) {
  Volume v;
  v.size = {256, 256, 108};
  v.spacing_mm = {0.9570312, 0.9570312, 1.5};
  v.direction(1, 1) = -1;
  std::vector<std::int16_t> raw(v.voxels());
  gzFile file = gzopen((folder / "matrix.dat.gz").c_str(), "rb");
  const int bytes = static_cast<int>(raw.size() * 2);
  EXPECT_EQ(gzread(file, raw.data(), static_cast<unsigned>(bytes)), bytes);
  gzclose(file);
  v.grey.assign(raw.begin(), raw.end());
  return v;
}

TEST(RealVolumes, HeadAgainstTheSurfaceOfAnotherProgram) {
  const fs::path folder = kData / "ct_head_invesalius";
  SKIP_WITHOUT(folder);
  const Volume volume = ReadHead(folder);
  EXPECT_EQ(CountFrom(volume, 226), 475759);
  const auto reference = ReadMesh(folder / "surface_0.ply");
  ASSERT_TRUE(reference) << ToString(reference.error());
  SurfaceOptions options;
  options.segment.threshold = 226;
  options.segment.drop_side_walls = false;
  options.segment.fill_cavities = false;
  options.isosurface.local_threshold = false;  // the reference is the plain isosurface
  options.smoothing_iterations = 0;
  options.decimate.faces = 2000000;
  const auto result = ExtractSurface(volume, options);
  ASSERT_TRUE(result) << ToString(result.error());
  EXPECT_TRUE(result->topology.closed_manifold());
  // Our vertices lie on the threshold, between air and bone, apart from the closed border.
  std::vector<double> off;
  for (const Eigen::Vector3d& p : result->mesh.vertices)
    off.push_back(std::abs(GreyAt(volume, p) - 226));
  std::nth_element(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2),
                   off.end());
  EXPECT_LT(off[off.size() / 2], 5);
  // Off the half-way level interpolation lies outside of the voxel count, by 0.05 voxel here.
  const double voxel_mm3 = volume.spacing_mm.prod();
  EXPECT_NEAR(SignedVolume(result->mesh),
              static_cast<double>(result->segmentation.voxels) * voxel_mm3,
              0.03 * SignedVolume(result->mesh));
  // Distance of our vertices (we keep the largest bone only; border caps left out) to the nearest
  // of the reference, by a grid of 2 mm.
  const double cell = 2;
  const BoundingBox box = BoundsOf(*reference);
  const Eigen::Vector3i n =
      ((box.high - box.low) / cell).cast<int>() + Eigen::Vector3i::Constant(1);
  const auto at = [&](const Eigen::Vector3i& c) {
    return static_cast<std::size_t>(c.x() + n.x() * (c.y() + n.y() * c.z()));
  };
  std::vector<std::vector<std::uint32_t>> grid(static_cast<std::size_t>(n.prod()));
  for (std::uint32_t v = 0; v < reference->vertices.size(); ++v)
    grid[at(((reference->vertices[v] - box.low) / cell).cast<int>())].push_back(v);
  std::vector<double> distance;
  for (std::size_t v = 0; v < result->mesh.vertices.size(); v += 7) {
    const Eigen::Vector3d& p = result->mesh.vertices[v];
    if (p.z() < 1 || p.z() > 106 * 1.5) continue;
    const Eigen::Vector3i c = ((p - box.low) / cell).array().floor().cast<int>();
    double best = cell;
    for (int k = -1; k <= 1; ++k)
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
          const Eigen::Vector3i b = c + Eigen::Vector3i(i, j, k);
          if ((b.array() < 0).any() || (b.array() >= n.array()).any()) continue;
          for (const std::uint32_t u : grid[at(b)])
            best = std::min(best, (reference->vertices[u] - p).norm());
        }
    distance.push_back(best);
  }
  std::sort(distance.begin(), distance.end());
  const double median = distance[distance.size() / 2], p90 = distance[distance.size() * 9 / 10];
  RecordProperty("median_mm", std::to_string(median));
  RecordProperty("p90_mm", std::to_string(p90));
  EXPECT_LT(median, 0.5);  // half a voxel; the reference is smoothed and reduced
  EXPECT_LT(p90, 1.0);
}

}  // namespace
}  // namespace scan
