// lab_scene PICTURES STATE TURNTABLE LIFT: the motors of the lab from these positions in steps, and
// a UVC camera that shows what stands before it: of the pictures that lab_pictures made the one for
// where the motors have come to, else one that no capture may keep (a plain magenta). SIGUSR1 takes
// the specimen off the platter, SIGUSR2 puts it back. Writes to STATE, whole, after every picture
// sent: "turntable POSITION EDGES POWERED", and the lift's.
#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
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

// The painter of the gadget: every picture is of where the motors stand when it is asked for.
struct Scene {
  Pictures pictures;
  std::vector<std::byte> elsewhere;
  std::shared_ptr<MotorModel> motors;
  fs::path state;

  std::size_t operator()(const GadgetFrame& frame, std::span<std::uint8_t> out) const {
    if (!frame.jpeg || !motors->Sync() || !WriteState(state, *motors)) return 0;
    const std::vector<std::byte>& jpeg = Seen();
    const std::size_t size = std::min(jpeg.size(), out.size());
    std::memcpy(out.data(), jpeg.data(), size);
    return size;
  }

  const std::vector<std::byte>& Seen() const {
    const std::int64_t turn = LabTurntable(0).steps_per_turn;
    for (const auto& [place, jpeg] : pictures) {
      const auto [turntable, lift, present] = place;
      const std::int64_t off = std::abs(motors->State("turntable").position - turntable) % turn;
      if (std::min(off, turn - off) <= kNearSteps && present == (g_present != 0) &&
          std::abs(motors->State("lift").position - lift) <= kNearSteps)
        return jpeg;
    }
    return elsewhere;
  }
};

Status Serve(const fs::path& folder, const fs::path& state, std::int64_t turntable,
             std::int64_t lift) {
  Scene scene;
  SCAN_TRY(scene.pictures, ReadPictures(folder));
  SCAN_TRY(scene.elsewhere, ReadBinaryFile(folder / "elsewhere.jpg"));
  SCAN_TRY(const LabBoard board, LabBoardFromEnvironment());
  SCAN_TRY(scene.motors, MotorModel::Start(board, {LabTurntable(turntable), LabLift(lift)}));
  scene.state = state;
  SCAN_TRY(const auto gadget, UvcGadget::Open(std::move(scene)));
  gadget->Run();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    fmt::print(stderr, "usage: lab_scene PICTURES STATE TURNTABLE LIFT\n");
    return 2;
  }
  struct sigaction action {};
  action.sa_handler = OnRemoved;
  sigaction(SIGUSR1, &action, nullptr);
  action.sa_handler = OnPlaced;
  sigaction(SIGUSR2, &action, nullptr);
  const Status served = Serve(argv[1], argv[2], std::atoll(argv[3]), std::atoll(argv[4]));
  fmt::print(stderr, "lab_scene: {}\n", ToString(served.error()));
  return 1;
}
