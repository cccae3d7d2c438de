#include "reconstruction/pose/start_search.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "reconstruction/pose/rigid_motion.h"
#include "reconstruction/pose/start_templates.h"

namespace scan {
namespace {

using namespace start;

struct SearchView {
  int view = 0;
  Silhouette silhouette;
  Eigen::Matrix3d centred_from_table;  // rotation; the camera turned to the silhouette's centroid
  Eigen::Vector3d centre_in_table;     // of the camera
  double distance_mm = 0;              // nominal, to the table's origin
};

SearchView MakeSearchView(const RigModel& rig, const PhotoContour& photo, int view, int count) {
  SearchView s;
  s.view = view;
  const CameraFromTable camera_from_table = rig.NominalCameraFromTable(view);
  Eigen::Matrix3d turn;
  s.silhouette = SilhouetteOf(photo, rig.nominal_intrinsics(rig.views()[view].lens), count, turn);
  s.centred_from_table = turn * camera_from_table.rotation();
  s.centre_in_table = CameraCentre(camera_from_table);
  s.distance_mm = s.centre_in_table.norm();
  return s;
}

// Nearest viewing direction by a look-up on the faces of a cube.
class DirectionIndex {
 public:
  explicit DirectionIndex(const std::vector<Eigen::Vector3d>& directions)
      : nearest_(6 * kCells * kCells) {
    tbb::parallel_for(std::size_t{0}, nearest_.size(), [&](std::size_t i) {
      const int cell = static_cast<int>(i) % (kCells * kCells),
                face = static_cast<int>(i) / (kCells * kCells);
      const double u = 2 * (cell % kCells + 0.5) / kCells - 1,
                   v = 2 * (cell / kCells + 0.5) / kCells - 1;
      Eigen::Vector3d p;
      p[face / 2] = face % 2 ? -1 : 1;
      p[(face / 2 + 1) % 3] = u;
      p[(face / 2 + 2) % 3] = v;
      double best = -2;
      for (std::size_t k = 0; k < directions.size(); ++k) {
        const double cosine = directions[k].dot(p);
        if (cosine > best) {
          best = cosine;
          nearest_[i] = static_cast<int>(k);
        }
      }
    });
  }
  int Nearest(const Eigen::Vector3d& d) const {
    int axis = 0;
    d.cwiseAbs().maxCoeff(&axis);
    const double m = std::abs(d[axis]);
    const auto cell = [&](double x) {
      return std::clamp(static_cast<int>((x / m + 1) * 0.5 * kCells), 0, kCells - 1);
    };
    const int face = 2 * axis + (d[axis] < 0 ? 1 : 0);
    return nearest_[static_cast<std::size_t>((face * kCells + cell(d[(axis + 2) % 3])) * kCells +
                                             cell(d[(axis + 1) % 3]))];
  }

 private:
  static constexpr int kCells = 48;
  std::vector<int> nearest_;
};

// The tables of one search: score of (view, direction, angle).
struct ScoreTables {
  std::size_t directions = 0, angles = 0;
  std::vector<float> scores;
  float& At(std::size_t view, std::size_t direction, std::size_t angle) {
    return scores[(view * directions + direction) * angles + angle];
  }
};

ScoreTables ScoreAll(const std::vector<Template>& templates, const std::vector<SearchView>& views,
                     double template_distance_mm, const StartOptions& options) {
  ScoreTables tables;
  tables.directions = templates.size();
  tables.angles = static_cast<std::size_t>(options.angles);
  tables.scores.resize(views.size() * tables.directions * tables.angles);
  const double step = 2 * kPi / options.angles;
  std::vector<std::vector<std::vector<Eigen::Vector2f>>> view_points(views.size());
  for (std::size_t v = 0; v < views.size(); ++v)
    for (int a = 0; a < options.angles; ++a)
      view_points[v].push_back(Rotated(views[v].silhouette.points, -a * step));
  tbb::parallel_for(std::size_t{0}, templates.size(), [&](std::size_t k) {
    const Silhouette& t = templates[k].silhouette;
    for (std::size_t a = 0; a < tables.angles; ++a) {
      const auto template_points = Rotated(t.points, static_cast<double>(a) * step);
      for (std::size_t v = 0; v < views.size(); ++v) {
        float score = 1;
        if (!t.points.empty() && !views[v].silhouette.points.empty()) {
          const double ratio = views[v].silhouette.root_area * views[v].distance_mm /
                               (t.root_area * template_distance_mm);
          const double size = std::max(0.0, std::abs(std::log(ratio)) - options.size_slack);
          score = MeanDistance(views[v].silhouette.field, template_points) +
                  MeanDistance(t.field, view_points[v][a]) +
                  static_cast<float>(std::min(1.0, 0.5 * size));
        }
        tables.At(v, k, a) = score;
      }
    }
  });
  return tables;
}

struct Match {
  std::size_t direction = 0, angle = 0;
  double angle_rad = 0;
};

// The template and angle in the picture that a rotation of the model shows.
Match MatchOf(const Eigen::Matrix3d& centred_from_model, const std::vector<Template>& templates,
              const DirectionIndex& index, int angles) {
  Match m;
  m.direction = static_cast<std::size_t>(index.Nearest(-centred_from_model.row(2).transpose()));
  // turn = centred_from_model * camera_from_model': only what its angle about z depends on.
  const Eigen::Matrix3d& shown = templates[m.direction].camera_from_model;
  const auto turn = [&](int i, int k) { return centred_from_model.row(i).dot(shown.row(k)); };
  m.angle_rad = std::atan2(turn(1, 0) - turn(0, 1), turn(0, 0) + turn(1, 1));
  const int a = static_cast<int>(std::lround(m.angle_rad / (2 * kPi) * angles));
  m.angle = static_cast<std::size_t>((a % angles + angles) % angles);
  return m;
}

// The mass centre in the table frame: nearest to the rays through its pictures, and weakly to the
// distances that the silhouettes' sizes give.
Eigen::Vector3d PlaceOf(const Eigen::Matrix3d& table_from_model,
                        const std::vector<Template>& templates, const DirectionIndex& index,
                        const std::vector<SearchView>& views, double template_distance_mm,
                        int angles) {
  constexpr double kAlong = 1e-3;  // weight of the distance against the ray's direction
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const SearchView& view : views) {
    const Match m = MatchOf(view.centred_from_table * table_from_model, templates, index, angles);
    const Template& t = templates[m.direction];
    const double size = view.silhouette.root_area / std::max(t.silhouette.root_area, 1e-12);
    const Eigen::Vector2d offset = Eigen::Rotation2Dd(m.angle_rad) * (-size * t.centroid);
    const Eigen::Vector3d ray =
        (view.centred_from_table.transpose() * offset.homogeneous()).normalized();
    const Eigen::Vector3d at = view.centre_in_table + template_distance_mm / size * ray;
    const Eigen::Matrix3d weight =
        Eigen::Matrix3d::Identity() - (1 - kAlong) * ray * ray.transpose();
    normal += weight;
    right += weight * at;
  }
  return normal.ldlt().solve(right);
}

}  // namespace

std::vector<Eigen::Vector3d> IcosphereDirections(int subdivisions) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  std::vector<Eigen::Vector3d> points = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                                         {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                                         {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
  std::vector<Face> faces = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                             {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                             {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                             {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (auto& p : points) p.normalize();
  for (int level = 0; level < subdivisions; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    std::vector<Face> finer;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [place, added] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(points.size()));
      if (added) points.push_back((points[a] + points[b]).normalized());
      return place->second;
    };
    for (const Face& f : faces) {
      const auto a = middle(f[0], f[1]), b = middle(f[1], f[2]), c = middle(f[2], f[0]);
      finer.insert(finer.end(), {{f[0], a, c}, {f[1], b, a}, {f[2], c, b}, {a, b, c}});
    }
    faces = std::move(finer);
  }
  return points;
}

TriangleMesh ClusteredMesh(const TriangleMesh& mesh, double cell_mm) {
  TriangleMesh clustered;
  std::map<std::array<std::int64_t, 3>, std::uint32_t> cells;
  std::vector<std::uint32_t> cell_of(mesh.vertices.size());
  std::vector<int> count;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    std::array<std::int64_t, 3> key{};
    for (int k = 0; k < 3; ++k)
      key[static_cast<std::size_t>(k)] =
          static_cast<std::int64_t>(std::floor(mesh.vertices[i][k] / cell_mm));
    const auto [place, added] =
        cells.try_emplace(key, static_cast<std::uint32_t>(clustered.vertices.size()));
    if (added) {
      clustered.vertices.push_back(Eigen::Vector3d::Zero());
      count.push_back(0);
    }
    cell_of[i] = place->second;
    clustered.vertices[place->second] += mesh.vertices[i];
    ++count[place->second];
  }
  for (std::size_t i = 0; i < count.size(); ++i) clustered.vertices[i] /= count[i];
  for (const Face& f : mesh.faces) {
    const Face face{cell_of[f[0]], cell_of[f[1]], cell_of[f[2]]};
    if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0])
      clustered.faces.push_back(face);
  }
  return clustered;
}

TriangleMesh MeshForRoughSteps(const ContourMesh& mesh) {
  TriangleMesh coarse = ClusteredMesh(mesh.mesh, mesh.radius_mm / 30);
  const bool coarser =
      coarse.faces.size() > 1000 && 2 * coarse.faces.size() < mesh.mesh.faces.size();
  return coarser ? coarse : mesh.mesh;
}

std::vector<StartCandidate> SearchStarts(const ContourMesh& mesh, const RigModel& rig,
                                         std::span<const PhotoContour> photos,
                                         const std::vector<bool>& use, const StartOptions& options,
                                         std::stop_token stop) {
  std::vector<SearchView> views;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    if (use[i])
      views.push_back(MakeSearchView(rig, photos[i], static_cast<int>(i), options.points));
  }
  if (views.empty()) return {};
  double distance_mm = 0;
  for (const SearchView& view : views)
    distance_mm += view.distance_mm / static_cast<double>(views.size());

  const std::vector<Eigen::Vector3d> directions = IcosphereDirections(options.subdivisions);
  const TriangleMesh coarse = ClusteredMesh(mesh.mesh, 2 * mesh.radius_mm / kSide);
  std::vector<Template> templates(directions.size());
  tbb::parallel_for(std::size_t{0}, directions.size(), [&](std::size_t k) {
    if (stop.stop_requested()) return;
    templates[k] = RenderTemplate(coarse, mesh.closed, mesh.centre, mesh.radius_mm, directions[k],
                                  distance_mm, options.points);
  });
  if (stop.stop_requested()) return {};
  ScoreTables tables = ScoreAll(templates, views, distance_mm, options);
  const DirectionIndex index(directions);

  // Orientations: those that the first view can tell apart.
  const auto rotation_of = [&](std::size_t i) -> Eigen::Matrix3d {
    const double angle = 2 * kPi * static_cast<double>(i % tables.angles) / options.angles;
    return views[0].centred_from_table.transpose() *
           Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
           templates[i / tables.angles].camera_from_model;
  };
  std::vector<float> score(tables.directions * tables.angles);
  tbb::parallel_for(std::size_t{0}, score.size(), [&](std::size_t i) {
    const Eigen::Matrix3d rotation = rotation_of(i);
    float sum = 0;
    for (std::size_t v = 0; v < views.size(); ++v) {
      const Match m =
          MatchOf(views[v].centred_from_table * rotation, templates, index, options.angles);
      sum += tables.At(v, m.direction, m.angle);
    }
    score[i] = sum / static_cast<float>(views.size());
  });
  std::vector<std::size_t> order(score.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::size_t looked_at = std::min<std::size_t>(order.size(), 20000);
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(looked_at),
                    order.end(), [&](std::size_t a, std::size_t b) {
                      return std::pair(score[a], a) < std::pair(score[b], b);
                    });
  std::vector<StartCandidate> candidates;
  for (std::size_t n = 0; n < looked_at; ++n) {
    if (static_cast<int>(candidates.size()) >= options.candidates) break;
    const Eigen::Matrix3d rotation = rotation_of(order[n]);
    const bool known = std::any_of(candidates.begin(), candidates.end(), [&](const auto& c) {
      return AngleBetween(c.table_from_model.rotation(), rotation) < options.distinct_rad;
    });
    if (known) continue;
    const Eigen::Vector3d place =
        PlaceOf(rotation, templates, index, views, distance_mm, options.angles);
    candidates.push_back(
        {TableFromModel(rotation, place - rotation * mesh.centre), score[order[n]]});
  }
  return candidates;
}

}  // namespace scan
