#include "tests/lab/scene.h"

#include <fmt/format.h>
#include <signal.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>

#include "drivers/base/files.h"
#include "tests/lab/motor_model.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

volatile sig_atomic_t g_present = 1;
void OnRemoved(int) { g_present = 0; }
void OnPlaced(int) { g_present = 1; }

constexpr std::int64_t kNearSteps = 5;  // where the switches were seen is not the same to the step

Status ReadPictures(const fs::path& folder, Scene& scene) {
  SCAN_TRY(scene.elsewhere, ReadBinaryFile(folder / "elsewhere.jpg"));
  std::ifstream index(folder / "index");
  std::int64_t turntable = 0, lift = 0;
  bool present = false;
  for (std::string name; index >> turntable >> lift >> present >> name;) {
    SCAN_TRY(scene.pictures[(Scene::Place{turntable, lift, present})],
             ReadBinaryFile(folder / name));
  }
  if (scene.pictures.empty())
    return BadInput("no pictures", (folder / "index").string(), "make them with lab_pictures");
  return {};
}

Status WriteState(const fs::path& path, const MotorModel& model) {
  const fs::path beside = path.string() + ".new";
  {
    std::ofstream out(beside);
    for (const char* name : {"turntable", "lift"}) {
      const LabMotorState state = model.State(name);
      out << fmt::format("{} {} {} {}\n", name, state.position, state.edges, state.powered ? 1 : 0);
    }
  }
  fs::rename(beside, path);
  return {};
}

Result<WhereFn> FollowGpio(const fs::path& state, std::int64_t turntable, std::int64_t lift) {
  SCAN_TRY(const LabBoard board, LabBoardFromEnvironment());
  SCAN_TRY(auto started, MotorModel::Start(board, {LabTurntable(turntable), LabLift(lift)}));
  const std::shared_ptr<MotorModel> motors = std::move(started);
  return WhereFn([motors, state]() -> Result<std::pair<std::int64_t, std::int64_t>> {
    SCAN_CHECK(motors->Sync());
    SCAN_CHECK(WriteState(state, *motors));
    return std::pair(motors->State("turntable").position, motors->State("lift").position);
  });
}

Result<std::int64_t> ReadPlace(const fs::path& file) {
  std::int64_t place = 0;
  if (std::ifstream(file) >> place) return place;
  return Failed("no place of a motor", file.string(), "start lab_tic first");
}

WhereFn FollowTics(const fs::path& turntable, const fs::path& lift) {
  return [turntable, lift]() -> Result<std::pair<std::int64_t, std::int64_t>> {
    SCAN_TRY(const std::int64_t turned, ReadPlace(turntable));
    SCAN_TRY(const std::int64_t lifted, ReadPlace(lift));
    return std::pair(turned, lifted);
  };
}

}  // namespace

const std::vector<std::byte>* Scene::Seen() const {
  const auto at = where();
  if (!at) return nullptr;
  for (const auto& [place, jpeg] : pictures) {
    const auto [there, high, present] = place;
    if (std::abs(at->first - there) <= kNearSteps && std::abs(at->second - high) <= kNearSteps &&
        present == (g_present != 0))
      return &jpeg;
  }
  return &elsewhere;
}

Result<Scene> MakeScene(std::span<char* const> words) {
  if (words.size() != 3 && words.size() != 4)
    return BadInput("a scene has three or four words", "command line",
                    "write PICTURES STATE TURNTABLE LIFT, or PICTURES PLACE PLACE");
  struct sigaction action {};
  action.sa_handler = OnRemoved;
  sigaction(SIGUSR1, &action, nullptr);
  action.sa_handler = OnPlaced;
  sigaction(SIGUSR2, &action, nullptr);
  Scene scene;
  SCAN_CHECK(ReadPictures(words[0], scene));
  if (words.size() == 3) {
    scene.where = FollowTics(words[1], words[2]);
  } else {
    SCAN_TRY(scene.where, FollowGpio(words[1], std::atoll(words[2]), std::atoll(words[3])));
  }
  return scene;
}

}  // namespace scan
