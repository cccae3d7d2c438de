#include "reconstruction/surface/decimate.h"

#include <fmt/format.h>
#include <meshoptimizer.h>
#include <tbb/parallel_for.h>
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

// Where collapses met in thin places, with other faces than these the simplifier starts again.
constexpr int kMostRounds = 4;
constexpr double kProtectedEdges = 6;  // about such a place, in mean edge lengths
constexpr std::size_t kMostPlaces = 2000;

// Positions about the centre in units of the largest extent: the simplifier works in float.
struct UnitPositions {
  std::vector<float> xyz;
  double scale = 1;

  explicit UnitPositions(const TriangleMesh& mesh) {
    const BoundingBox box = BoundsOf(mesh);
    const Eigen::Vector3d centre = box.centre();
    scale = std::max((box.high - box.low).maxCoeff(), 1e-300);
    xyz.reserve(mesh.vertices.size() * 3);
    for (const Eigen::Vector3d& v : mesh.vertices)
      for (int a = 0; a < 3; ++a) xyz.push_back(static_cast<float>((v[a] - centre[a]) / scale));
  }
};

// One run of the simplifier. Faces with `kept` stay as they are. A manifold, perhaps in pieces.
TriangleMesh Simplify(const TriangleMesh& mesh, const UnitPositions& positions,
                      const std::vector<std::uint8_t>& kept, std::size_t faces, double& error_mm) {
  TriangleMesh out;
  std::vector<unsigned int> indices;
  indices.reserve(mesh.faces.size() * 3);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    if (kept[f])
      out.faces.push_back(mesh.faces[f]);
    else
      indices.insert(indices.end(), mesh.faces[f].begin(), mesh.faces[f].end());
  const std::size_t wanted = faces - std::min(faces, out.faces.size());
  const unsigned int lock = out.faces.empty() ? 0 : meshopt_SimplifyLockBorder;
  std::vector<unsigned int> simplified(indices.size());
  float error = 0;
  const std::size_t count =
      meshopt_simplify(simplified.data(), indices.data(), indices.size(), positions.xyz.data(),
                       mesh.vertices.size(), 3 * sizeof(float), wanted * 3, 1.0f, lock, &error);
  error_mm = error * positions.scale;  // it is relative to the largest extent
  for (std::size_t n = 0; n + 2 < count; n += 3)
    out.faces.push_back({simplified[n], simplified[n + 1], simplified[n + 2]});
  out.vertices = mesh.vertices;
  MakeManifold(out);
  return out;
}

// Where MakeManifold took pieces apart: places of several vertices.
std::vector<Eigen::Vector3d> PinchedPlaces(const TriangleMesh& mesh) {
  const auto less = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  };
  std::vector<Eigen::Vector3d> sorted = mesh.vertices, out;
  std::sort(sorted.begin(), sorted.end(), less);
  for (std::size_t n = 1; n < sorted.size(); ++n)
    if (sorted[n] == sorted[n - 1] && (out.empty() || out.back() != sorted[n]))
      out.push_back(sorted[n]);
  return out;
}

double MeanEdge(const TriangleMesh& mesh) {
  double sum = 0;
  for (const Face& f : mesh.faces) sum += (mesh.vertices[f[0]] - mesh.vertices[f[1]]).norm();
  return sum / static_cast<double>(mesh.faces.size());
}

// Marks the faces about these places; false when all of them were marked before.
bool Protect(const TriangleMesh& mesh, const std::vector<Eigen::Vector3d>& places, double radius_mm,
             std::vector<std::uint8_t>& kept) {
  std::vector<std::uint8_t> near(mesh.vertices.size(), 0);
  tbb::parallel_for(std::size_t{0}, near.size(), [&](std::size_t v) {
    near[v] = std::any_of(places.begin(), places.end(), [&](const Eigen::Vector3d& p) {
      return (mesh.vertices[v] - p).squaredNorm() <= radius_mm * radius_mm;
    });
  });
  bool any = false;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const Face& c = mesh.faces[f];
    if (kept[f] || !(near[c[0]] || near[c[1]] || near[c[2]])) continue;
    kept[f] = 1;
    any = true;
  }
  return any;
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
  const UnitPositions positions(mesh);
  const TopologyReport topology = CheckTopology(mesh);
  std::vector<std::uint8_t> kept(mesh.faces.size(), 0);
  for (int round = 0; round < kMostRounds; ++round) {
    out.mesh = Simplify(mesh, positions, kept, options.faces, out.quadric_error_mm);
    const TopologyReport now = CheckTopology(out.mesh);
    if (now.components == topology.components && now.euler == topology.euler) break;
    const auto places = PinchedPlaces(out.mesh);
    if (places.empty() || places.size() > kMostPlaces) break;
    if (!Protect(mesh, places, kProtectedEdges * MeanEdge(mesh), kept)) break;
  }
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
