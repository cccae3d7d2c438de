// lab_ptp FOLDER [SCENE...]: a still camera as a USB gadget behind FunctionFS mounted at FOLDER. It
// takes pictures of a scene (words: see scene.h), or plain ones that differ. Every picture is also
// kept as FOLDER.sent/NUMBER.jpg. Runs until ended.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>

#include "drivers/base/files.h"
#include "drivers/camera/encode_picture.h"
#include "tests/lab/ptp_responder.h"
#include "tests/lab/scene.h"

namespace {

using namespace scan;

std::vector<std::byte> PlainPicture(const PtpShot& shot) {
  const cv::Mat picture(240, 320, CV_8UC3,
                        cv::Scalar(shot.number * 40 % 256, 128, shot.exposure_us / 100));
  const auto jpeg = EncodePicture(picture, "jpg", 90);
  return jpeg ? jpeg->bytes : std::vector<std::byte>();
}

Status Serve(std::span<char* const> words) {
  if (words.empty())
    return BadInput("no folder", "command line", "write lab_ptp FOLDER [SCENE...]");
  const std::string folder = words[0];
  std::shared_ptr<const Scene> scene;
  if (words.size() > 1) {
    SCAN_TRY(Scene made, MakeScene(words.subspan(1)));
    scene = std::make_shared<const Scene>(std::move(made));
  }
  std::filesystem::create_directories(folder + ".sent");
  const auto paint = [scene, folder](const PtpShot& shot) {
    std::vector<std::byte> jpeg;
    if (!scene)
      jpeg = PlainPicture(shot);
    else if (const auto* seen = scene->Seen())
      jpeg = *seen;
    (void)WriteFileDurably(fmt::format("{}.sent/{}.jpg", folder, shot.number), jpeg);
    const auto* begin = reinterpret_cast<const std::uint8_t*>(jpeg.data());
    return std::vector<std::uint8_t>(begin, begin + jpeg.size());
  };
  SCAN_TRY(const auto responder, PtpResponder::Open(folder, paint));
  fmt::print("camera in {}\n", folder);
  fflush(stdout);
  responder->Run();
}

}  // namespace

int main(int argc, char** argv) {
  const Status served = Serve({argv + 1, static_cast<std::size_t>(std::max(argc - 1, 0))});
  fmt::print(stderr, "lab_ptp: {}\n", ToString(served.error()));
  return 1;
}
