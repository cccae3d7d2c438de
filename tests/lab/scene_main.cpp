// A UVC camera that shows what stands before it: of the pictures that lab_pictures made the one for
// where the motors have come to, else one that no capture may keep (a plain magenta). SIGUSR1 takes
// the specimen off the platter, SIGUSR2 puts it back.
//   lab_scene PICTURES STATE TURNTABLE LIFT   the motors on GPIO lines, from these positions in
//   steps;
//       what they have come to is written to STATE with every picture, whole: "turntable POSITION
//       EDGES POWERED", and the lift's
//   lab_scene PICTURES TURNTABLE_PLACE LIFT_PLACE   the motors of two lab_tic boards
#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <span>
#include <tuple>

#include "drivers/base/files.h"
#include "tests/lab/motor_model.h"
#include "tests/lab/uvc_gadget.h"

namespace {

using namespace scan;
namespace fs = std::filesystem;

volatile sig_atomic_t g_present = 1;
void OnRemoved(int) { g_present = 0; }
void OnPlaced(int) { g_present = 1; }

constexpr std::int64_t kNearSteps = 5;  // where the switches were seen is not the same to the step

using Place = std::tuple<std::int64_t, std::int64_t, bool>;  // turntable, lift, specimen there
using Pictures = std::map<Place, std::vector<std::byte>>;

Result<Pictures> ReadPictures(const fs::path& folder) {
  std::ifstream index(folder / "index");
  Pictures pictures;
  std::int64_t turntable = 0, lift = 0;
  bool present = false;
  for (std::string name; index >> turntable >> lift >> present >> name;) {
    SCAN_TRY(pictures[(Place{turntable, lift, present})], ReadBinaryFile(folder / name));
  }
  if (pictures.empty())
    return BadInput("no pictures", (folder / "index").string(), "make them with lab_pictures");
  return pictures;
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

// Positions of turntable and lift, in steps from their switches.
using WhereFn = std::function<Result<std::pair<std::int64_t, std::int64_t>>()>;

// The painter of the gadget: every picture is of where the motors stand when it is asked for.
struct Scene {
  Pictures pictures;
  std::vector<std::byte> elsewhere;
  WhereFn where;

  std::size_t operator()(const GadgetFrame& frame, std::span<std::uint8_t> out) const {
    if (!frame.jpeg) return 0;
    const auto at = where();
    if (!at) return 0;
    const std::vector<std::byte>& jpeg = Seen(at->first, at->second);
    const std::size_t size = std::min(jpeg.size(), out.size());
    std::memcpy(out.data(), jpeg.data(), size);
    return size;
  }

  const std::vector<std::byte>& Seen(std::int64_t turntable, std::int64_t lift) const {
    for (const auto& [place, jpeg] : pictures) {
      const auto [there, high, present] = place;
      if (std::abs(turntable - there) <= kNearSteps && std::abs(lift - high) <= kNearSteps &&
          present == (g_present != 0))
        return jpeg;
    }
    return elsewhere;
  }
};

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

Status Serve(std::span<char*> words) {
  Scene scene;
  SCAN_TRY(scene.pictures, ReadPictures(words[0]));
  SCAN_TRY(scene.elsewhere, ReadBinaryFile(fs::path(words[0]) / "elsewhere.jpg"));
  if (words.size() == 3) {
    scene.where = FollowTics(words[1], words[2]);
  } else {
    SCAN_TRY(scene.where, FollowGpio(words[1], std::atoll(words[2]), std::atoll(words[3])));
  }
  SCAN_TRY(const auto gadget, UvcGadget::Open(std::move(scene)));
  gadget->Run();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4 && argc != 5) {
    fmt::print(stderr, "usage: lab_scene PICTURES STATE TURNTABLE LIFT | PICTURES PLACE PLACE\n");
    return 2;
  }
  struct sigaction action {};
  action.sa_handler = OnRemoved;
  sigaction(SIGUSR1, &action, nullptr);
  action.sa_handler = OnPlaced;
  sigaction(SIGUSR2, &action, nullptr);
  const Status served = Serve({argv + 1, static_cast<std::size_t>(argc - 1)});
  fmt::print(stderr, "lab_scene: {}\n", ToString(served.error()));
  return 1;
}
