#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <sstream>

#include "tests/accuracy/real_sets/real_set.h"

namespace scan::test {
namespace {

constexpr double kLevel = 0.19 * 255;  // stated with the photographs
// Mean brightness of holes in the silhouette: 7.6 to 14.4 where the background is seen through,
// from 22 on in shadowed folds.
constexpr double kFoldLevel = 18;

cv::Mat Disk(int diameter) {
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, {diameter, diameter});
}

void FillFolds(const cv::Mat& bright, cv::Mat& component) {
  cv::Mat labels;
  const int count = cv::connectedComponents(~component, labels, 4);
  for (int k = 1; k < count; ++k) {
    const cv::Mat part = labels == k;
    const cv::Rect box = cv::boundingRect(part);
    const bool hole = box.x > 0 && box.y > 0 && box.br().x < part.cols && box.br().y < part.rows;
    if (hole && cv::mean(bright, part)[0] > kFoldLevel) component.setTo(255, part);
  }
}

// The largest bright component, its dark folds filled; sub-pixel at its edge, where the brightness
// passes the level.
Mask DinoMask(const cv::Mat& bgr) {
  std::vector<cv::Mat> channels;
  cv::split(bgr, channels);
  const cv::Mat bright = cv::max(cv::max(channels[0], channels[1]), channels[2]);
  cv::Mat closed, labels, stats, centroids;
  cv::morphologyEx(bright > kLevel, closed, cv::MORPH_CLOSE, Disk(15));
  const int count = cv::connectedComponentsWithStats(closed, labels, stats, centroids);
  int largest = 1;
  for (int k = 2; k < count; ++k)
    if (stats.at<int>(k, cv::CC_STAT_AREA) > stats.at<int>(largest, cv::CC_STAT_AREA)) largest = k;
  cv::Mat component = labels == largest;
  FillFolds(bright, component);
  cv::Mat inner, outer, soft;
  cv::erode(component, inner, Disk(7));
  cv::dilate(component, outer, Disk(7));
  bright.convertTo(soft, CV_8U, 127.5 / kLevel);
  Mask mask;
  mask.coverage = cv::Mat(bgr.size(), CV_8U, cv::Scalar(0));
  soft.copyTo(mask.coverage, outer);
  mask.coverage.setTo(255, inner | (component & (bright <= kLevel)));
  return mask;
}

bool IsWhole(const cv::Mat& coverage) {
  cv::Mat points;
  cv::findNonZero(coverage >= 128, points);
  constexpr int kMargin = 4;
  const cv::Rect box = cv::boundingRect(points);
  return box.x >= kMargin && box.y >= kMargin && box.br().x <= coverage.cols - kMargin &&
         box.br().y <= coverage.rows - kMargin;
}

// "NAME k11 ... k33 r11 ... r33 t1 t2 t3": pixels with the first centre at 0, metres.
struct DinoCamera {
  std::string name;
  Intrinsics intrinsics;
  CameraFromModel camera_from_model;
};
std::optional<DinoCamera> ParseCamera(const std::string& line) {
  std::istringstream in(line);
  DinoCamera camera;
  Eigen::Matrix3d k, r;
  Eigen::Vector3d t;
  in >> camera.name;
  for (auto* m : {&k, &r})
    for (int i = 0; i < 9; ++i) in >> (*m)(i / 3, i % 3);
  in >> t.x() >> t.y() >> t.z();
  if (!in) return std::nullopt;
  camera.intrinsics = {640, 480, k(0, 0), k(1, 1), k(0, 2) + 0.5, k(1, 2) + 0.5};
  camera.camera_from_model = CameraFromModel(r, 1000 * t);
  return camera;
}

}  // namespace

std::optional<RealSet> LoadDino(const std::filesystem::path& folder) {
  std::ifstream cameras(folder / "dino_par.txt"), good(folder / "dino_good_silhouette_images.txt");
  if (!cameras || !good) return std::nullopt;
  std::set<std::string> listed;
  for (std::string name; good >> name;) listed.insert(name);
  RealSet set;
  set.voxel_mm = 0.6;
  set.box_mm = {Eigen::Vector3d(-46, -4, -42), Eigen::Vector3d(35, 93, 40)};
  for (std::string line; std::getline(cameras, line);) {
    const auto camera = ParseCamera(line);
    if (!camera || !listed.contains(camera->name)) continue;
    Photo photo;
    photo.path = folder / camera->name;
    photo.id = photo.name = photo.path.stem().string();
    const cv::Mat picture = cv::imread(photo.path.string());
    if (picture.empty()) return std::nullopt;
    set.intrinsics = camera->intrinsics;
    set.photos.photos.push_back(photo);
    set.truth.push_back(camera->camera_from_model);
    set.masks.push_back(DinoMask(picture));
    set.whole.push_back(IsWhole(set.masks.back().coverage));
  }
  set.photos.lens_states = {{"lens", set.intrinsics, {0.002, 1.0}}};
  set.photos.aims = {{"a0", "c0", 0, std::nullopt, {}, {}}};
  return set;
}

}  // namespace scan::test
