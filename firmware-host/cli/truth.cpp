#include "firmware-host/cli/truth.h"

#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "acquisition/session/session_reader.h"
#include "drivers/base/files.h"

namespace scan {
namespace {

using FrameKey = std::pair<std::string, std::uint64_t>;  // camera, sensor sequence

PoseOf PoseFrom(const nlohmann::json& line) {
  Eigen::Isometry3d isometry = Eigen::Isometry3d::Identity();
  const auto& rows = line.at("camera_from_model");
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c)
      isometry.matrix()(r, c) =
          rows.at(static_cast<std::size_t>(r)).at(static_cast<std::size_t>(c)).get<double>();
  const auto& in = line.at("intrinsics");
  const auto number = [&in](const char* key) { return in.at(key).get<double>(); };
  return {CameraFromModel(isometry),
          {.w = in.at("w").get<int>(),
           .h = in.at("h").get<int>(),
           .fl_x = number("fl_x"),
           .fl_y = number("fl_y"),
           .cx = number("cx"),
           .cy = number("cy"),
           .k1 = number("k1"),
           .k2 = number("k2"),
           .p1 = number("p1"),
           .p2 = number("p2"),
           .k3 = number("k3")}};
}

Result<std::map<FrameKey, PoseOf>> ReadFrames(const std::filesystem::path& path) {
  SCAN_TRY(const std::string text, ReadTextFile(path));
  std::map<FrameKey, PoseOf> frames;
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    try {
      const auto json = nlohmann::json::parse(line);
      frames[{json.at("camera").get<std::string>(),
              json.at("sensor_sequence").get<std::uint64_t>()}] = PoseFrom(json);
    } catch (const nlohmann::json::exception& e) {
      return BadInput(std::string("not a truth line (") + e.what() + ")",
                      path.string() + ":" + std::to_string(number), "record it again");
    }
  }
  return frames;
}

}  // namespace

Result<std::vector<PoseOf>> ReadTruth(const std::filesystem::path& truth,
                                      const std::filesystem::path& session,
                                      const PhotoSet& photos) {
  SCAN_TRY(const auto frames, ReadFrames(truth));
  SCAN_TRY(const Session read, ReadSession(session));
  std::vector<PoseOf> poses;
  for (const Photo& photo : photos.photos) {
    const FrameEntry* frame = read.state.Frame(photo.id, 0);
    const auto found = frame ? frames.find({frame->camera, frame->sensor_sequence}) : frames.end();
    if (found == frames.end())
      return BadInput("the truth has no frame of view " + photo.id, truth.string(),
                      "give the truth file of this session");
    poses.push_back(found->second);
  }
  return poses;
}

}  // namespace scan
