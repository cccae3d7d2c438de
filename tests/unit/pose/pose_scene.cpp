#include "pose_scene.h"

#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>

#include "drivers/base/rng.h"
#include "reconstruction/pose/rigid_motion.h"
#include "reconstruction/pose/silhouette_raster.h"

namespace scan::test {
namespace {

Eigen::Vector3d Gaussian(Rng& rng, double sigma) {
  const double x = rng.Normal(), y = rng.Normal(), z = rng.Normal();
  return sigma * Eigen::Vector3d(x, y, z);
}

void AddEllipsoid(TriangleMesh& mesh, int subdivisions, const Eigen::Vector3d& centre,
                  const Eigen::Vector3d& axes, const Eigen::Vector3d& turn) {
  TriangleMesh ball;
  const double g = (1 + std::sqrt(5.0)) / 2;
  ball.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  ball.faces = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int level = 0; level < subdivisions; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middle;
    std::vector<Face> faces;
    const auto mid = [&](std::uint32_t a, std::uint32_t b) {
      const auto [place, added] = middle.try_emplace(
          {std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(ball.vertices.size()));
      if (added)
        ball.vertices.push_back(ball.vertices[a].normalized() + ball.vertices[b].normalized());
      return place->second;
    };
    for (const Face& f : ball.faces) {
      const std::uint32_t a = mid(f[0], f[1]), b = mid(f[1], f[2]), c = mid(f[2], f[0]);
      faces.insert(faces.end(), {{f[0], a, c}, {f[1], b, a}, {f[2], c, b}, {a, b, c}});
    }
    ball.faces = std::move(faces);
  }
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  const Eigen::Matrix3d rotation = ExpSo3(turn);
  for (const auto& v : ball.vertices)
    mesh.vertices.push_back(centre + rotation * axes.cwiseProduct(v.normalized()));
  for (const Face& f : ball.faces) mesh.faces.push_back({f[0] + base, f[1] + base, f[2] + base});
}

}  // namespace

TriangleMesh BugMesh(int subdivisions, double bent_rad) {
  TriangleMesh mesh;
  const auto add = [&](Eigen::Vector3d c, Eigen::Vector3d a, Eigen::Vector3d t) {
    AddEllipsoid(mesh, subdivisions, c, a, t);
  };
  add({0, 0, 8}, {11, 6, 5}, {0, 0, 0});
  add({11, 0, 9}, {4, 3.5, 3}, {0, 0.2, 0});
  add({15, 1, 11}, {3.5, 0.8, 0.8}, {0, -0.6, 0.1});  // horn
  add({6, 8, 5}, {0.7, 6, 0.7}, {-0.5, 0, 0.3});      // legs, all different
  add({0, 8, 5}, {0.6, 7, 0.6}, {-0.6, 0, 0});
  add({-7, 7, 4}, {0.7, 5, 0.7}, {-0.7, 0, -0.5});
  const auto leg = mesh.vertices.size();
  add({5, -8, 5}, {0.7, 6, 0.7}, {0.5, 0, -0.2});
  const Eigen::Vector3d hip(4.5, -5, 6.5);
  for (auto v = mesh.vertices.begin() + static_cast<std::ptrdiff_t>(leg); v != mesh.vertices.end();
       ++v)
    *v = hip + ExpSo3({bent_rad, 0, 0}) * (*v - hip);
  add({-5, -8, 4}, {0.6, 7, 0.6}, {0.5, 0, 0.6});
  return mesh;
}

ViewState BugView() {
  ViewState state;
  state.camera_from_model = CameraFromModel(ExpSo3({1.7, 0.2, 0.4}), Eigen::Vector3d(0, 0, 550));
  state.intrinsics = {924, 612, 2740, 2740, 462, 306, 0, 0, 0, 0, 0};
  return state;
}

TriangleMesh RevolutionMesh(int facets, const Eigen::Vector3d& axis) {
  // A profile like a pear, closed at both poles.
  constexpr int kRings = 120;
  const Eigen::Matrix3d turn =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), axis).toRotationMatrix();
  TriangleMesh mesh;
  const auto vertex = [&](double radius, double z, double angle) {
    mesh.vertices.push_back(turn *
                            Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), z));
  };
  vertex(0, -12, 0);
  for (int i = 1; i < kRings; ++i) {
    const double t = kPi * i / kRings;
    for (int j = 0; j < facets; ++j)
      vertex((11 - 2.5 * std::cos(t)) * std::sin(t) * (1 - 0.12 * std::cos(3 * t)),
             -12 * std::cos(t), 2 * kPi * j / facets);
  }
  vertex(0, 12, 0);
  const auto at = [&](int i, int j) {
    return static_cast<std::uint32_t>(1 + (i - 1) * facets + j % facets);
  };
  const auto top = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  for (int j = 0; j < facets; ++j) {
    mesh.faces.push_back({0, at(1, j + 1), at(1, j)});
    for (int i = 1; i + 1 < kRings; ++i) {
      mesh.faces.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      mesh.faces.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
    mesh.faces.push_back({top, at(kRings - 1, j), at(kRings - 1, j + 1)});
  }
  return mesh;
}

Mask RenderMask(const TriangleMesh& mesh, const CameraFromModel& camera_from_model,
                const Intrinsics& intrinsics) {
  constexpr int kSamples = 8;
  std::vector<Eigen::Vector2d> pixels;
  double x0 = 1e9, x1 = -1e9, y0 = 1e9, y1 = -1e9;
  for (const auto& v : mesh.vertices) {
    pixels.push_back(Project(intrinsics, camera_from_model * v).value_or(Eigen::Vector2d(-1, -1)));
    x0 = std::min(x0, pixels.back().x());
    x1 = std::max(x1, pixels.back().x());
    y0 = std::min(y0, pixels.back().y());
    y1 = std::max(y1, pixels.back().y());
  }
  Mask mask;
  mask.coverage = cv::Mat(intrinsics.h, intrinsics.w, CV_8U, cv::Scalar(0));
  const cv::Rect box =
      cv::Rect(static_cast<int>(std::floor(x0)) - 1, static_cast<int>(std::floor(y0)) - 1,
               static_cast<int>(x1 - x0) + 4, static_cast<int>(y1 - y0) + 4) &
      cv::Rect(0, 0, intrinsics.w, intrinsics.h);
  if (box.area() == 0) return mask;
  std::vector<Eigen::Vector2f> fine;
  for (const auto& p : pixels)
    fine.push_back((kSamples * (p - Eigen::Vector2d(box.x, box.y))).cast<float>());
  cv::Mat covered(kSamples * box.height, kSamples * box.width, CV_8U, cv::Scalar(0));
  FillTriangles(fine, mesh.faces, covered);
  cv::Mat reduced;
  cv::resize(covered, reduced, box.size(), 0, 0, cv::INTER_AREA);
  reduced.copyTo(mask.coverage(box));
  return mask;
}

SceneOptions MediumPhotos(int views, bool static_errors) {
  SceneOptions options;
  options.w = 924;
  options.h = 612;
  options.views = views;
  options.static_errors = static_errors;
  return options;
}

Scene MakeScene(const TriangleMesh& mesh, const TableFromModel& table_from_model,
                const SceneOptions& options) {
  Scene scene;
  Rng rng(options.seed);
  scene.table_from_model = table_from_model;
  PhotoSet& photos = scene.photos;
  Intrinsics nominal;
  nominal.w = options.w;
  nominal.h = options.h;
  nominal.fl_x = nominal.fl_y = options.focal_mm / options.sensor_mm * options.w;
  nominal.cx = options.w / 2.0;
  nominal.cy = options.h / 2.0;
  const double errors = options.static_errors ? 1.0 : 0.0;
  const Eigen::Matrix3d axis = ExpSo3(errors * RadFromDeg(0.5) * Eigen::Vector3d(0.8, -0.6, 0));
  const BoundingBox box = BoundsOf(mesh);
  const Eigen::Vector3d aimed_at = table_from_model * box.centre();
  const int aims = static_cast<int>(options.elevations_deg.size());
  for (int a = 0; a < aims; ++a) {
    LensState lens;
    lens.id = "lens" + std::to_string(a);
    lens.intrinsics = nominal;
    lens.sigma = {0.001, 3.0};
    photos.lens_states.push_back(lens);
    const double elevation = RadFromDeg(options.elevations_deg[a]);
    // The camera looks at a place near the specimen from +x, up to the elevation.
    const Eigen::Vector3d target(0, 0, aimed_at.z());
    const Eigen::Vector3d away(std::cos(elevation), 0, std::sin(elevation));
    Eigen::Matrix3d rotation;  // rows: x right, y down, z forward
    rotation.row(2) = -away.transpose();
    rotation.row(0) =
        Eigen::Vector3d(-away).cross(Eigen::Vector3d::UnitZ()).normalized().transpose();
    rotation.row(1) =
        rotation.row(2).transpose().cross(Eigen::Vector3d(rotation.row(0).transpose())).transpose();
    const Eigen::Vector3d centre = target + options.radius_mm * away;
    Aim aim;
    aim.id = "a" + std::to_string(a);
    aim.camera = "c0";
    aim.lens_state = a;
    aim.camera_from_lift = CameraFromLift(rotation, -rotation * centre);
    aim.sigma = {RadFromDeg(0.3), 1.0};
    photos.aims.push_back(aim);
  }
  std::vector<CameraFromLift> true_aims;
  std::vector<Intrinsics> true_lenses;
  for (int a = 0; a < aims; ++a) {
    Vector6d off;
    off.head<3>() = Gaussian(rng, errors * RadFromDeg(0.2) / std::sqrt(3.0));
    off.tail<3>() = Gaussian(rng, errors * 0.5 / std::sqrt(3.0));
    true_aims.push_back(MovedAbout(*photos.aims[a].camera_from_lift, off, Eigen::Vector3d::Zero()));
    Intrinsics in = nominal;
    in.fl_x *= 1 + errors * 0.0005;
    in.fl_y *= 1 + errors * 0.0005;
    in.cx += errors * 3.0 * std::cos(1.0);
    in.cy += errors * 3.0 * std::sin(1.0);
    true_lenses.push_back(in);
  }
  for (int i = 0; i < options.views; ++i) {
    Photo photo;
    photo.id = photo.name = (i < 10 ? "v00" : "v0") + std::to_string(i);
    const int per_aim = options.views / aims;
    photo.aim = std::min(aims - 1, i / std::max(1, per_aim));
    const double angle = 2 * kPi * (i % per_aim) / per_aim;
    photo.turntable_rad = AxisPrior{angle, RadFromDeg(0.1), RadFromDeg(0.02)};
    photo.lift_mm = AxisPrior{0, 0.05, 0.02};
    photos.photos.push_back(photo);
    const SceneFaults& faults = options.faults;
    const auto since = [i](int from) { return from >= 0 && i >= from; };
    TableFromModel placing = table_from_model;
    if (since(faults.turned_over_at)) placing = faults.turned_over;
    if (since(faults.moved_from) && i < faults.moved_until)
      placing = MovedAbout(placing, faults.moved, placing * box.centre());
    double true_angle = faults.sign_inverted ? -angle : angle;
    if (since(faults.steps_lost_from)) true_angle -= faults.steps_lost_rad;
    if (since(faults.resumed_at)) true_angle += faults.resumed_zero_rad;
    if (since(faults.turned_over_at)) scene.photos.photos.back().mounting_id = "m1";
    if (since(faults.resumed_at)) scene.photos.photos.back().reference_epoch = 2;
    const StationFromTable turn =
        MakeStationFromTable(true_angle + errors * rng.Normal() * RadFromDeg(0.01));
    const LiftFromStation tilted(axis, errors * Eigen::Vector3d(0.2, -0.1, 0));
    scene.truth.push_back(true_aims[photo.aim] * tilted * turn * placing);
    scene.true_intrinsics.push_back(true_lenses[photo.aim]);
    scene.masks.push_back(RenderMask(mesh, scene.truth.back(), true_lenses[photo.aim]));
  }
  return scene;
}

}  // namespace scan::test
