#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <map>
#include <sstream>

#include "acquisition/import/sources.h"
#include "acquisition/session/picture_header.h"
#include "drivers/base/files.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

// The words of one line of a COLMAP text file.
class Words {
 public:
  Words(const std::string& line, std::string where) : in_(line), where_(std::move(where)) {}

  Result<std::string> Text() {
    std::string word;
    if (!(in_ >> word)) return Wrong("the line ends too early");
    return word;
  }
  Result<double> Number() {
    SCAN_TRY(const std::string word, Text());
    double value = 0;
    const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (code != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
      return Wrong("'" + word + "' is not a number");
    return value;
  }
  Result<int> Int() {
    SCAN_TRY(const double value, Number());
    if (value != std::floor(value) || std::abs(value) > 1e9)
      return Wrong(fmt::format("{} is not an integer", value));
    return static_cast<int>(value);
  }
  std::string Rest() {
    std::string rest;
    std::getline(in_ >> std::ws, rest);
    while (!rest.empty() && (rest.back() == '\r' || rest.back() == ' ')) rest.pop_back();
    return rest;
  }
  tl::unexpected<Error> Wrong(std::string what) const {
    return BadInput(std::move(what), where_, "export the model from COLMAP as text again");
  }

 private:
  std::istringstream in_;
  std::string where_;
};

// Where each parameter of a model goes; the focal length of one-focal models goes to both.
const std::map<std::string, std::vector<double Intrinsics::*>>& Models() {
  using I = Intrinsics;
  static const std::map<std::string, std::vector<double I::*>> models = {
      {"SIMPLE_PINHOLE", {&I::fl_x, &I::cx, &I::cy}},
      {"PINHOLE", {&I::fl_x, &I::fl_y, &I::cx, &I::cy}},
      {"SIMPLE_RADIAL", {&I::fl_x, &I::cx, &I::cy, &I::k1}},
      {"RADIAL", {&I::fl_x, &I::cx, &I::cy, &I::k1, &I::k2}},
      {"OPENCV", {&I::fl_x, &I::fl_y, &I::cx, &I::cy, &I::k1, &I::k2, &I::p1, &I::p2}},
      {"FULL_OPENCV",
       {&I::fl_x, &I::fl_y, &I::cx, &I::cy, &I::k1, &I::k2, &I::p1, &I::p2, &I::k3}}};
  return models;
}

Result<Intrinsics> CameraFrom(Words& words) {
  SCAN_TRY(const std::string name, words.Text());
  const auto model = Models().find(name);
  if (model == Models().end()) return words.Wrong("camera model '" + name + "' is not known here");
  Intrinsics in;
  SCAN_TRY(in.w, words.Int());
  SCAN_TRY(in.h, words.Int());
  for (const auto parameter : model->second) {
    SCAN_TRY(in.*parameter, words.Number());
  }
  if (in.fl_y == 0) in.fl_y = in.fl_x;
  std::istringstream higher(words.Rest());  // k4 k5 k6
  for (double rest = 0; higher >> rest;)
    if (rest != 0) return words.Wrong("distortion beyond k3 is not known here");
  if (in.w < 1 || in.h < 1 || !(in.fl_x > 0) || !(in.fl_y > 0))
    return words.Wrong("a size or focal length that is not positive");
  return in;
}

bool IsComment(const std::string& line) {
  const auto first = line.find_first_not_of(" \t\r");
  return first == line.npos || line[first] == '#';
}

Result<std::map<int, Intrinsics>> ReadCameras(const fs::path& file) {
  SCAN_TRY(const std::string text, ReadTextFile(file));
  std::istringstream lines(text);
  std::map<int, Intrinsics> cameras;
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (IsComment(line)) continue;
    Words words(line, fmt::format("{} line {}", file.string(), number));
    SCAN_TRY(const int id, words.Int());
    SCAN_TRY(cameras[id], CameraFrom(words));
  }
  return cameras;
}

Result<ImportedPhoto> ImageFrom(Words& words, const std::map<int, Intrinsics>& cameras,
                                const fs::path& photos) {
  SCAN_CHECK(words.Int());  // IMAGE_ID
  double v[7] = {};
  for (double& value : v) {
    SCAN_TRY(value, words.Number());
  }
  const Eigen::Quaterniond q(v[0], v[1], v[2], v[3]);
  if (!(std::abs(q.norm() - 1) < 1e-3)) return words.Wrong("not a unit quaternion");
  SCAN_TRY(const int camera, words.Int());
  const auto found = cameras.find(camera);
  if (found == cameras.end()) return words.Wrong(fmt::format("unknown camera {}", camera));
  const std::string name = words.Rest();
  ImportedPhoto photo;
  photo.path = photos / name;
  photo.intrinsics = found->second;
  photo.camera_from_table =
      CameraFromTable(q.normalized().toRotationMatrix(), Eigen::Vector3d(v[4], v[5], v[6]));
  std::error_code code;
  if (name.empty() || !fs::is_regular_file(photo.path, code))
    return words.Wrong("no photograph '" + name + "' in " + photos.string());
  SCAN_TRY(const PictureHeader header, ReadPictureHeader(photo.path));
  if (header.w != photo.intrinsics.w || header.h != photo.intrinsics.h)
    return words.Wrong(fmt::format("'{}' has {} x {} pixels where its camera says {} x {}", name,
                                   header.w, header.h, photo.intrinsics.w, photo.intrinsics.h));
  return photo;
}

}  // namespace

Result<ImportedSet> PhotosFromColmap(const fs::path& folder, const fs::path& photos) {
  SCAN_TRY(const auto cameras, ReadCameras(folder / "cameras.txt"));
  const fs::path file = folder / "images.txt";
  SCAN_TRY(const std::string text, ReadTextFile(file));
  std::istringstream lines(text);
  ImportedSet set;
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (IsComment(line)) continue;
    Words words(line, fmt::format("{} line {}", file.string(), number));
    SCAN_TRY(ImportedPhoto photo, ImageFrom(words, cameras, photos));
    set.photos.push_back(std::move(photo));
    std::getline(lines, line);  // the picture's points, often empty
    ++number;
  }
  if (set.photos.empty())
    return BadInput("no photograph is listed", file.string(), "export the model as text again");
  return set;
}

}  // namespace scan
