#include "reconstruction/surface/decimate.h"

#include <fmt/format.h>
#include <meshoptimizer.h>
#include <vtkCellArray.h>
#include <vtkGenericCell.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStaticCellLocator.h>

#include <algorithm>
#include <cmath>

#include "reconstruction/surface/clean.h"

namespace scan {
namespace {

constexpr std::size_t kDeviationSamples = 40000;
constexpr double kLeastFaces = 16;  // of a component

// Positions about the centre in units of the largest extent: the simplifier works in float.
std::vector<float> UnitPositions(const TriangleMesh& mesh, const Eigen::Vector3d& centre,
                                 double scale) {
  std::vector<float> out;
  out.reserve(mesh.vertices.size() * 3);
  for (const Eigen::Vector3d& v : mesh.vertices)
    for (int a = 0; a < 3; ++a) out.push_back(static_cast<float>((v[a] - centre[a]) / scale));
  return out;
}

void MeasureDeviation(const TriangleMesh& original, Decimation& out) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const Eigen::Vector3d& v : out.mesh.vertices) points->InsertNextPoint(v.data());
  vtkNew<vtkCellArray> cells;
  for (const Face& f : out.mesh.faces) cells->InsertNextCell({f[0], f[1], f[2]});
  vtkNew<vtkPolyData> surface;
  surface->SetPoints(points);
  surface->SetPolys(cells);
  surface->BuildCells();
  vtkNew<vtkStaticCellLocator> locator;
  locator->SetDataSet(surface);
  locator->BuildLocator();
  vtkNew<vtkGenericCell> cell;
  const std::size_t step = std::max<std::size_t>(1, original.vertices.size() / kDeviationSamples);
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t v = 0; v < original.vertices.size(); v += step, ++count) {
    double closest[3], squared = 0;
    vtkIdType id = -1;
    int sub = 0;
    locator->FindClosestPoint(original.vertices[v].data(), closest, cell, id, sub, squared);
    sum += squared;
    out.max_deviation_mm = std::max(out.max_deviation_mm, std::sqrt(squared));
  }
  out.rms_deviation_mm = std::sqrt(sum / static_cast<double>(std::max<std::size_t>(count, 1)));
}

}  // namespace

Result<Decimation> Decimate(const TriangleMesh& mesh, const DecimateOptions& options) {
  Decimation out;
  if (mesh.faces.size() <= options.faces) {
    out.mesh = mesh;
    return out;
  }
  const BoundingBox box = BoundsOf(mesh);
  const double scale = std::max((box.high - box.low).maxCoeff(), 1e-300);
  const std::vector<float> positions = UnitPositions(mesh, box.centre(), scale);
  std::vector<unsigned int> indices, simplified(mesh.faces.size() * 3);
  indices.reserve(simplified.size());
  for (const Face& f : mesh.faces) indices.insert(indices.end(), f.begin(), f.end());
  float error = 0;
  const std::size_t kept =
      meshopt_simplify(simplified.data(), indices.data(), indices.size(), positions.data(),
                       mesh.vertices.size(), 3 * sizeof(float), options.faces * 3, 1.0f, 0, &error);
  // `error` is relative to the largest extent, which is 1 here.
  out.quadric_error_mm = error * scale;
  out.mesh.vertices = mesh.vertices;
  for (std::size_t n = 0; n + 2 < kept; n += 3)
    out.mesh.faces.push_back({simplified[n], simplified[n + 1], simplified[n + 2]});
  MakeManifold(out.mesh);
  // Collapses that met have nipped off specks of a few faces.
  DropSmallComponents(out.mesh, std::min(0.01, kLeastFaces / static_cast<double>(options.faces)),
                      false);
  if (out.mesh.faces.empty() || !CheckTopology(out.mesh).closed_manifold())
    return Failed(
        fmt::format("the mesh cannot be reduced to {} faces and stay closed", options.faces),
        "decimation", "ask for more --faces");
  MeasureDeviation(mesh, out);
  return out;
}

}  // namespace scan
