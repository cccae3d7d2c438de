#include "colmap.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "../clocks.h"

namespace scan::bench {
namespace {

namespace fs = std::filesystem;

// Removed at the end.
struct Scratch {
  Scratch() {
    std::string pattern = (fs::temp_directory_path() / "scanstation-peers-XXXXXX").string();
    if (::mkdtemp(pattern.data())) path = pattern;
  }
  ~Scratch() {
    std::error_code ignored;
    if (!path.empty()) fs::remove_all(path, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  fs::path path;
};

double ChildSeconds() {
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

bool Colmap(const fs::path& folder, const std::string& arguments) {
  const std::string command = fmt::format(
      "cd '{}' && QT_QPA_PLATFORM=offscreen timeout 600 colmap {} >> log 2>&1", folder.string(), arguments);
  return std::system(command.c_str()) == 0;
}

std::string NameOf(std::size_t photo) { return fmt::format("{:03}.png", photo); }

// images.txt: two lines a photograph, the first of them ID QW QX QY QZ TX TY TZ CAMERA NAME.
std::vector<std::optional<CameraFromModel>> ReadImages(const fs::path& file, std::size_t photos) {
  std::vector<std::optional<CameraFromModel>> poses(photos);
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream fields(line);
    int id = 0, camera = 0;
    double w = 0, x = 0, y = 0, z = 0;
    Eigen::Vector3d t;
    std::string name;
    if (!(fields >> id >> w >> x >> y >> z >> t.x() >> t.y() >> t.z() >> camera >> name)) continue;
    for (std::size_t i = 0; i < photos; ++i)
      if (name == NameOf(i))
        poses[i] =
            CameraFromModel(Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix(), t);
    std::getline(in, line);
  }
  return poses;
}

std::ptrdiff_t Solved(const std::vector<std::optional<CameraFromModel>>& poses) {
  return std::count_if(poses.begin(), poses.end(), [](const auto& p) { return p.has_value(); });
}

}  // namespace

Result<PeerPoses> SolveWithColmap(const PeerScene& scene) {
  if (std::system("command -v colmap > /dev/null 2>&1") != 0)
    return BadInput("colmap is not installed", "peers", "apt-get install colmap");
  const Scratch scratch;
  const fs::path& folder = scratch.path;
  if (folder.empty())
    return Failed("no folder can be made", "peers", "set TMPDIR to a folder that can be written");
  fs::create_directories(folder / "images");
  fs::create_directories(folder / "masks");
  fs::create_directories(folder / "sparse");
  for (std::size_t i = 0; i < scene.pictures.size(); ++i) {
    cv::imwrite((folder / "images" / NameOf(i)).string(), scene.pictures[i]);
    cv::imwrite((folder / "masks" / (NameOf(i) + ".png")).string(),
                scene.trial.masks[i].coverage > 127);
  }
  const Intrinsics& in = scene.trial.photos.intrinsics(scene.trial.photos.photos.front());
  PeerPoses result;
  result.method = "COLMAP";
  result.own_scale = true;
  const double start = Seconds(), processor = ChildSeconds();
  const bool ran =
      Colmap(folder, fmt::format("feature_extractor --database_path db --image_path images "
                                 "--ImageReader.mask_path masks --ImageReader.single_camera 1 "
                                 "--ImageReader.camera_model PINHOLE --ImageReader.camera_params "
                                 "{:.6f},{:.6f},{:.6f},{:.6f} --SiftExtraction.use_gpu 0",
                                 in.fl_x, in.fl_y, in.cx, in.cy)) &&
      Colmap(folder, "exhaustive_matcher --database_path db --SiftMatching.use_gpu 0") &&
      Colmap(folder,
             "mapper --database_path db --image_path images --output_path sparse "
             "--Mapper.ba_refine_focal_length 0 --Mapper.ba_refine_extra_params 0");
  result.seconds = Seconds() - start;
  result.processor_seconds = ChildSeconds() - processor;
  result.poses.resize(scene.pictures.size());
  int models = 0;
  for (const auto& model : fs::directory_iterator(folder / "sparse")) {
    ++models;
    const std::string at = "sparse/" + model.path().filename().string();
    if (!Colmap(folder, fmt::format("model_converter --input_path {0} --output_path {0} "
                                    "--output_type TXT",
                                    at)))
      continue;
    auto poses = ReadImages(model.path() / "images.txt", scene.pictures.size());
    if (Solved(poses) > Solved(result.poses)) result.poses = std::move(poses);
  }
  if (!ran || models == 0) result.remark = "found no model";
  if (models > 1) result.remark = fmt::format("largest of {} models", models);
  return result;
}

}  // namespace scan::bench
