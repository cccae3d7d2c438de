#include "reconstruction/surface/isosurface.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "reconstruction/volume/threshold.h"

namespace scan {
namespace {

// F is kept this share of a step away from zero: no crossing nearer to a voxel centre than about a
// hundredth of a voxel, hence no face without an area.
constexpr float kLeastShare = 0.01f;

struct Window {
  std::size_t low[3], high[3];  // inclusive
};

Window WindowAround(const VoxelSet& set, std::size_t i, std::size_t j, std::size_t k, int radius) {
  const std::size_t at[3] = {i, j, k}, r = static_cast<std::size_t>(radius);
  Window w{};
  for (int a = 0; a < 3; ++a) {
    w.low[a] = at[a] > r ? at[a] - r : 0;
    w.high[a] = std::min(at[a] + r, set.size[a] - 1);
  }
  return w;
}

struct Levels {
  float threshold, step;  // T, and material minus air
};

// What is air and what is material beyond doubt, and the band in which F follows the grey values.
struct Zones {
  VoxelSet core;      // specimen that touches no outside voxel, filled cavities left out
  VoxelSet deep;      // specimen deeper than two voxels
  VoxelSet near;      // specimen and the voxels that touch it
  VoxelSet open_air;  // outside voxels that touch nothing above the threshold
};

Zones MakeZones(const Volume& volume, const Segmentation& s) {
  Zones z;
  z.core = Eroded(s.specimen, 1);
  z.deep = Eroded(z.core, 1);
  for (std::size_t v = 0; v < z.core.inside.size(); ++v) z.core.inside[v] &= !s.filled.inside[v];
  z.near = Dilated(s.specimen, 1);
  VoxelSet solid = s.specimen;
  for (std::size_t v = 0; v < solid.inside.size(); ++v)
    solid.inside[v] |= volume.grey[v] >= s.threshold;
  z.open_air = Dilated(solid, 1);
  for (auto& v : z.open_air.inside) v = !v;
  return z;
}

float StepOf(const Volume& volume, const Segmentation& s) {
  const ClassMeans means = MeansAbout(volume, s.threshold);
  return static_cast<float>(std::max(means.above - means.below, 1e-6));
}

class HalfWay {
 public:
  HalfWay(const Volume& volume, const Segmentation& s, const Zones& zones,
          const IsosurfaceOptions& options)
      : volume_(volume), zones_(zones), options_(options) {
    fallback_ = {static_cast<float>(s.threshold), StepOf(volume, s)};
  }
  const Levels& fallback() const { return fallback_; }

  Levels At(std::size_t i, std::size_t j, std::size_t k) const {
    if (!options_.local_threshold) return fallback_;
    const Window w = WindowAround(zones_.core, i, j, k, options_.window_radius);
    double material = 0, air = 0;
    int cores = 0, airs = 0;
    for (std::size_t c = w.low[2]; c <= w.high[2]; ++c)
      for (std::size_t b = w.low[1]; b <= w.high[1]; ++b)
        for (std::size_t a = w.low[0]; a <= w.high[0]; ++a) {
          const std::size_t v = volume_.index(a, b, c);
          if (zones_.core.inside[v]) material += volume_.grey[v], ++cores;
          if (zones_.open_air.inside[v]) air += volume_.grey[v], ++airs;
        }
    if (cores == 0 || airs == 0) return fallback_;
    material /= cores;
    air /= airs;
    if (!(material > air)) return fallback_;
    return {static_cast<float>(0.5 * (material + air)), static_cast<float>(material - air)};
  }

 private:
  const Volume& volume_;
  const Zones& zones_;
  IsosurfaceOptions options_;
  Levels fallback_{};
};

float FieldValue(const Volume& volume, const Segmentation& s, const Zones& zones,
                 const HalfWay& half_way, std::size_t i, std::size_t j, std::size_t k) {
  const std::size_t v = volume.index(i, j, k);
  const float far = half_way.fallback().step;
  if (!zones.near.inside[v]) return -far;
  if (zones.deep.inside[v]) return far;
  const bool inside = s.specimen.inside[v];
  const Levels levels = half_way.At(i, j, k);
  if (inside && s.filled.inside[v]) return levels.step;
  if (!inside && volume.grey[v] >= s.threshold) return -levels.step;  // of a dropped component
  float f = volume.grey[v] - levels.threshold;
  if (inside && zones.core.inside[v]) f = std::max(f, 0.25f * levels.step);
  const float least = kLeastShare * levels.step;
  if (std::abs(f) < least) f = f < 0 ? -least : least;
  return f;
}

// F with one layer of air around it.
vtkNew<vtkImageData> MakeField(const Volume& volume, const Segmentation& s,
                               const IsosurfaceOptions& options) {
  const Zones zones = MakeZones(volume, s);
  const HalfWay half_way(volume, s, zones, options);
  const std::size_t w = volume.size[0] + 2, h = volume.size[1] + 2, d = volume.size[2] + 2;
  vtkNew<vtkImageData> image;
  image->SetDimensions(static_cast<int>(w), static_cast<int>(h), static_cast<int>(d));
  image->SetOrigin(-1, -1, -1);
  image->AllocateScalars(VTK_FLOAT, 1);
  float* field = static_cast<float*>(image->GetScalarPointer());
  const auto clamped = [](std::size_t p, std::size_t n) {
    return std::clamp<std::size_t>(p, 1, n) - 1;
  };
  tbb::parallel_for(std::size_t{0}, d, [&](std::size_t k) {
    for (std::size_t j = 0; j < h; ++j)
      for (std::size_t i = 0; i < w; ++i) {
        const bool border = i == 0 || j == 0 || k == 0 || i + 1 == w || j + 1 == h || k + 1 == d;
        const float f = FieldValue(volume, s, zones, half_way, clamped(i, volume.size[0]),
                                   clamped(j, volume.size[1]), clamped(k, volume.size[2]));
        field[i + w * (j + h * k)] = border ? -std::abs(f) : f;
      }
  });
  return image;
}

// What the field has above zero besides its largest component becomes air, what the outside does
// not reach becomes material: the field's own sign decides what leaks, voxels half-way in grey are
// not where the segmentation's one threshold has them.
void CloseInnerSpaces(const ExteriorOptions& exterior, float step, vtkImageData& image,
                      ContouredSurface& report) {
  const int* dimensions = image.GetDimensions();
  float* field = static_cast<float*>(image.GetScalarPointer());
  VoxelSet solid;
  for (std::size_t a = 0; a < 3; ++a) solid.size[a] = static_cast<std::size_t>(dimensions[a]);
  solid.inside.resize(solid.size[0] * solid.size[1] * solid.size[2]);
  for (std::size_t v = 0; v < solid.inside.size(); ++v) solid.inside[v] = field[v] > 0;
  const Labelling labelling = LabelComponents(solid, Connectivity::edges);
  const std::ptrdiff_t largest = LargestOf(labelling);
  for (std::size_t v = 0; v < solid.inside.size(); ++v)
    if (solid.inside[v] && static_cast<std::ptrdiff_t>(labelling.label[v]) != largest + 1) {
      solid.inside[v] = 0;
      field[v] = -step;
      ++report.speck_voxels;
    }
  report.specks =
      labelling.components.size() - std::min<std::size_t>(1, labelling.components.size());
  const VoxelSet inner = InnerSpaces(solid, exterior);
  for (std::size_t v = 0; v < inner.inside.size(); ++v)
    if (inner.inside[v]) field[v] = step;
}

// The contour filter separates what is above zero where it meets across the diagonal of a face
// only; of -F that is the outside: a thin leg holds together at edges (18-connected solid).
void Negate(vtkImageData& image) {
  float* field = static_cast<float*>(image.GetScalarPointer());
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, static_cast<std::size_t>(image.GetNumberOfPoints())),
      [&](const auto& range) {
        for (std::size_t v = range.begin(); v < range.end(); ++v) field[v] = -field[v];
      });
}

}  // namespace

ContouredSurface Isosurface(const Volume& volume, const Segmentation& segmentation,
                            const IsosurfaceOptions& options) {
  ContouredSurface out;
  const vtkNew<vtkImageData> field = MakeField(volume, segmentation, options);
  if (segmentation.exterior)
    CloseInnerSpaces(*segmentation.exterior, StepOf(volume, segmentation), *field, out);
  vtkNew<vtkFlyingEdges3D> contour;
  Negate(*field);
  contour->SetInputData(field);
  contour->SetValue(0, 0.0);
  contour->ComputeNormalsOff();
  contour->ComputeGradientsOff();
  contour->ComputeScalarsOff();
  contour->Update();
  vtkPolyData* surface = contour->GetOutput();

  TriangleMesh& mesh = out.mesh;
  const Eigen::Matrix3d model_from_index = volume.direction * volume.spacing_mm.asDiagonal();
  mesh.vertices.resize(static_cast<std::size_t>(surface->GetNumberOfPoints()));
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    Eigen::Vector3d p;
    surface->GetPoint(static_cast<vtkIdType>(v), p.data());
    mesh.vertices[v] = volume.origin_mm + model_from_index * p;
  }
  mesh.faces.reserve(static_cast<std::size_t>(surface->GetNumberOfPolys()));
  const bool mirrored = model_from_index.determinant() > 0;  // of -F
  vtkCellArray* polys = surface->GetPolys();
  vtkIdType count = 0;
  const vtkIdType* ids = nullptr;
  for (polys->InitTraversal(); polys->GetNextCell(count, ids);) {
    if (count != 3) continue;
    Face face{static_cast<std::uint32_t>(ids[0]), static_cast<std::uint32_t>(ids[1]),
              static_cast<std::uint32_t>(ids[2])};
    if (mirrored) std::swap(face[1], face[2]);
    mesh.faces.push_back(face);
  }
  return out;
}

}  // namespace scan
