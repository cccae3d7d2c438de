// Camera poses by other programs and methods on the same photographs: a table.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "clocks.h"
#include "drivers/base/units.h"
#include "peers/colmap.h"
#ifdef SCAN_HAVE_RAPID
#include "peers/trackers.h"
#endif
#include "pose_scene.h"
#include "reconstruction/evaluate/turntable_trial.h"
#include "reconstruction/pose/rig_model.h"
#include "reconstruction/specimens/photograph.h"
#include "reconstruction/specimens/specimen.h"
#include "reconstruction/surface/decimate.h"
#include "tests/accuracy/real_sets/squirrel_set.h"

namespace scan::bench {
namespace {

struct PeersOptions {
  std::vector<std::string> specimens{"beetle", "orchid"};
  int views = 24, width = 1848;
  std::size_t paper_views = 4, faces = 12000;
  std::string squirrel = std::string(SCAN_SOURCE_DIR) + "/../shared/data/squirrel_turntable";
};

// The poses that the log gives with a placing of the one mounting.
std::vector<CameraFromModel> LoggedPoses(const PhotoSet& photos, const TableFromModel& placing) {
  RigModel rig(photos, {});
  rig.set_start(0, placing);
  std::vector<CameraFromModel> poses;
  for (std::size_t i = 0; i < photos.photos.size(); ++i)
    poses.push_back(rig.CameraFromModelOf(rig.Nominal(), static_cast<int>(i)));
  return poses;
}

PeerScene MakePeerScene(const std::string& name, const PeersOptions& options) {
  PeerScene scene;
  scene.name = name;
  std::shared_ptr<const Specimen> specimen = MakeSpecimen(name).value();
  PoseTrial& trial = scene.trial;
  trial.mesh = trial.surface = ExactSurface(*specimen, 0.3);
  test::SceneOptions rig;
  rig.w = 462;  // its masks are not used
  rig.h = 306;
  rig.views = options.views;
  rig.static_errors = true;
  const TableFromModel placing(ExpSo3({0.02, -0.03, 0.7}), Eigen::Vector3d(0.5, -1, 14));
  const test::Scene made = test::MakeScene(ExactSurface(*specimen, 1), placing, rig);
  trial.photos = made.photos;
  for (std::size_t i = 0; i < made.truth.size(); ++i)
    trial.truth.push_back({made.truth[i], made.true_intrinsics[i]});
  StateErrors(trial, {.w = options.width});
  DrawMasks(trial, {.noise = {.sigma_px = 0.3}});
  const PhotographScene photographed = MakePhotographScene(specimen);
  for (const PoseOf& view : trial.truth)
    scene.pictures.push_back(
        RenderPhotograph(photographed, view.camera_from_model, view.intrinsics));
  Vector6d off;  // as an operator may state how a specimen stands
  off << 0.02, -0.015, 0.03, 0.5, -0.4, 0.3;
  scene.start = LoggedPoses(trial.photos, MovedAbout(placing, off, Eigen::Vector3d::Zero()));
  return scene;
}

// The scan's frame differs from the calibration's by a rotation that nobody states: the trackers
// start from what the joint solve says of the placing.
std::optional<PeerScene> SquirrelScene(const PeersOptions& options) {
  auto squirrel = test::LoadSquirrel(options.squirrel);
  if (!squirrel) return std::nullopt;
  PeerScene scene;
  scene.name = "squirrel";
  scene.same_frame = false;
  scene.trial.photos = squirrel->photos;
  scene.trial.masks = squirrel->masks;
  scene.trial.mesh = scene.trial.surface = squirrel->mesh;
  for (std::size_t i = 0; i < squirrel->masks.size(); ++i) {
    const std::string& name = squirrel->photos.photos[i].name;
    scene.pictures.push_back(cv::imread(options.squirrel + "/photos/" + name + ".jpg"));
    scene.trial.truth.push_back({squirrel->truth.views.at(name), squirrel->truth.intrinsics});
    Mask& mask = scene.trial.masks[i];  // the dark base makes the lowest 12 % unreliable
    cv::Mat points;
    cv::findNonZero(mask.coverage, points);
    const cv::Rect box = cv::boundingRect(points);
    mask.ignore = cv::Mat(mask.coverage.size(), CV_8U, cv::Scalar(0));
    mask.ignore.rowRange(box.y + static_cast<int>(0.88 * box.height), mask.ignore.rows).setTo(255);
  }
  return scene;
}

template <class Solve>
PeerPoses Timed(const char* method, const PoseTrial& trial, Solve&& solve) {
  PeerPoses result;
  result.method = method;
  result.poses.resize(trial.truth.size());
  const double start = Seconds(), processor = ProcessorSeconds();
  const Result<Poses> poses = solve();
  result.seconds = Seconds() - start;
  result.processor_seconds = ProcessorSeconds() - processor;
  if (!poses) {
    result.remark = ToString(poses.error());
    return result;
  }
  for (const ViewPose& view : poses->views)
    for (std::size_t i = 0; i < trial.truth.size(); ++i)
      if (trial.photos.photos[i].name == view.name && view.status == ViewStatus::accepted)
        result.poses[i] = view.camera_from_model;
  return result;
}

struct Errors {
  std::vector<double> rotation_deg, centre_mm;
};

Errors ErrorsOf(const PeerScene& scene, const PeerPoses& found, const Eigen::Matrix4d& similarity) {
  Errors errors;
  const double scale = similarity.block<3, 1>(0, 0).norm();
  const Eigen::Matrix3d turn = similarity.topLeftCorner<3, 3>() / scale;
  for (std::size_t i = 0; i < found.poses.size(); ++i) {
    if (!found.poses[i]) continue;
    const CameraFromModel& truth = scene.trial.truth[i].camera_from_model;
    const Eigen::Vector3d centre =
        (similarity * CameraCentre(*found.poses[i]).homogeneous()).head<3>();
    errors.centre_mm.push_back((centre - CameraCentre(truth)).norm());
    errors.rotation_deg.push_back(
        DegFromRad(AngleBetween(truth.rotation(), found.poses[i]->rotation() * turn.transpose())));
  }
  return errors;
}

// Of the camera centres; none for fewer than three.
std::optional<Eigen::Matrix4d> SimilarityOf(const PeerScene& scene, const PeerPoses& found) {
  std::vector<Eigen::Vector3d> from, to;
  for (std::size_t i = 0; i < found.poses.size(); ++i) {
    if (!found.poses[i]) continue;
    from.push_back(CameraCentre(*found.poses[i]));
    to.push_back(CameraCentre(scene.trial.truth[i].camera_from_model));
  }
  if (from.size() < 3) return std::nullopt;
  const auto matrix = [](const std::vector<Eigen::Vector3d>& points) {
    return Eigen::Map<const Eigen::Matrix3Xd>(points.front().data(), 3,
                                              static_cast<Eigen::Index>(points.size()));
  };
  return Eigen::Matrix4d(Eigen::umeyama(matrix(from), matrix(to), true));
}

std::string Cell(const std::vector<double>& values) {
  if (values.empty()) return "-";
  const Spread s = SpreadOf(values);
  return fmt::format("{:.3f} / {:.3f}", s.median, s.max);
}

void PrintRow(const PeerScene& scene, const PeerPoses& found) {
  const bool comparable = scene.same_frame && !found.own_scale;
  const Errors own = comparable ? ErrorsOf(scene, found, Eigen::Matrix4d::Identity()) : Errors{};
  const auto similarity = SimilarityOf(scene, found);
  const Errors aligned = similarity ? ErrorsOf(scene, found, *similarity) : Errors{};
  const auto solved =
      found.poses.size() -
      static_cast<std::size_t>(std::count(found.poses.begin(), found.poses.end(), std::nullopt));
  fmt::print("| {} | {} of {} | {} | {} | {} | {} | {:.1f} / {:.1f} |{}{}\n", found.method, solved,
             found.poses.size(), Cell(own.rotation_deg), Cell(own.centre_mm),
             Cell(aligned.rotation_deg), Cell(aligned.centre_mm), found.seconds,
             found.processor_seconds, found.remark.empty() ? "" : " ", found.remark);
  std::fflush(stdout);
}

PeerPoses Paper(const PeerScene& scene, const PeersOptions& options, const TriangleMesh& few) {
  const auto indices = EvenlySpread(scene.pictures.size(), options.paper_views);
  const PoseTrial some = Subset(scene.trial, indices);
  PeerPoses part =
      Timed("`paper`", some, [&] { return SolvePaper(few, some.photos, some.masks, {}); });
  part.remark += fmt::format("{} photographs tried", indices.size());
  PeerPoses all = part;
  all.poses.assign(scene.pictures.size(), std::nullopt);
  for (std::size_t k = 0; k < indices.size(); ++k) all.poses[indices[k]] = part.poses[k];
  return all;
}

void Run(PeerScene scene, const PeersOptions& options) {
  const PoseTrial& trial = scene.trial;
  fmt::print(
      "\n{}: {} photographs of {} x {}, mesh of {} faces ({} for paper and cv::rapid)\n"
      "| method | solved | rotation, deg | centre, mm | rotation after one similarity, deg | "
      "centre after it, mm | seconds of clock / processor |\n|---|---|---|---|---|---|---|\n",
      scene.name, scene.pictures.size(), scene.pictures.front().cols, scene.pictures.front().rows,
      trial.mesh.faces.size(), options.faces);
  PrintRow(scene, Timed("joint, logged poses", trial, [&] {
             auto poses = SolveJoint(trial.mesh, trial.photos, trial.masks, {});
             if (poses && scene.start.empty())
               scene.start = LoggedPoses(trial.photos, poses->mountings.front().table_from_model);
             return poses;
           }));
  JointOptions alone;
  alone.no_priors = true;
  PrintRow(scene, Timed("joint, no poses", trial,
                        [&] { return SolveJoint(trial.mesh, trial.photos, trial.masks, alone); }));
  TriangleMesh few = trial.mesh;
  if (few.faces.size() > options.faces)
    few = Decimate(trial.mesh, {.faces = options.faces}).value().mesh;
  if (!scene.start.empty()) {
    PeerPoses start;
    start.method = "start: the log, placing roughly known";
    for (const CameraFromModel& pose : scene.start) start.poses.emplace_back(pose);
    PrintRow(scene, start);
#ifdef SCAN_HAVE_RAPID
    for (const Tracker tracker : {Tracker::rapid, Tracker::optimal_local, Tracker::global_optimal})
      for (const bool on_masks : {false, true})
        PrintRow(scene, SolveWithTracker(scene, few, tracker, on_masks));
#else
    fmt::print("cv::rapid is not among this OpenCV's modules\n");
#endif
  }
  const auto colmap = SolveWithColmap(scene);
  if (colmap)
    PrintRow(scene, *colmap);
  else
    fmt::print("{}\n", ToString(colmap.error()));
  if (options.paper_views > 0) PrintRow(scene, Paper(scene, options, few));
}

}  // namespace
}  // namespace scan::bench

int main(int argc, char** argv) {
  scan::bench::PeersOptions options;
  CLI::App app("Camera poses by other programs on the same photographs", "bench_pose_peers");
  app.add_option("--specimen", options.specimens)
      ->check(CLI::IsMember(scan::SpecimenNames()))
      ->capture_default_str();
  app.add_option("--views", options.views, "of a synthetic specimen")
      ->check(CLI::Range(4, 1000))
      ->capture_default_str();
  app.add_option("--width", options.width, "of its photographs, px")
      ->check(CLI::Range(200, 8000))
      ->capture_default_str();
  app.add_option("--paper-views", options.paper_views, "photographs for the paper's own method")
      ->capture_default_str();
  app.add_option("--squirrel", options.squirrel, "folder of the real photographs");
  CLI11_PARSE(app, argc, argv);
  for (const std::string& specimen : options.specimens)
    scan::bench::Run(scan::bench::MakePeerScene(specimen, options), options);
  if (auto squirrel = scan::bench::SquirrelScene(options))
    scan::bench::Run(std::move(*squirrel), options);
  else
    fmt::print("\nsquirrel: the data folder is not here ({})\n", options.squirrel);
  return 0;
}
