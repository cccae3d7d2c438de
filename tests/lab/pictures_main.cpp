// lab_pictures STATION OUT: what the camera of a station file sees at every view of its plan, with
// the specimen and the rig's errors of [sim], for lab_scene to show. Writes OUT/N.jpg,
// OUT/elsewhere.jpg, OUT/truth.json (for scanstation evaluate --truth), OUT/surface.ply (the exact
// surface), and last OUT/index ("TURNTABLE LIFT PRESENT FILE", positions in steps).
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "acquisition/plan/station_plan.h"
#include "acquisition/session/json_fields.h"
#include "drivers/base/files.h"
#include "drivers/base/units.h"
#include "drivers/camera/encode_picture.h"
#include "drivers/station/geometry.h"
#include "drivers/station/sim_world.h"
#include "drivers/station/station_file.h"
#include "firmware-host/daemon/sim_scene.h"
#include "reconstruction/mesh/mesh_io.h"
#include "reconstruction/specimens/specimen.h"

namespace {

using namespace scan;
namespace fs = std::filesystem;
using Json = nlohmann::json;

// Steps from the home switch, as the lab's motors count them.
std::int64_t StepsAt(const AxisConfig& axis, double position) {
  return std::llround((position - axis.homing.position) * axis.steps_per_unit * axis.sign);
}

TrueState StateOf(const StationConfig& config, const SimWorld& world, const PlannedView& view) {
  TrueState state;
  state.turntable_rad = RadFromDeg(view.turntable_deg);
  state.lift_mm = view.lift_mm;
  state.intrinsics = world.TrueIntrinsics(view.camera);
  state.camera_from_model = world.TrueCameraFromLift(view.camera, view.aim_id) *
                            MakeLiftFromStation(state.lift_mm, LiftDirection(config)) *
                            world.TrueStationFromTable(state.turntable_rad) *
                            world.table_from_model();
  return state;
}

Status MakePictures(const fs::path& station, const fs::path& out) {
  SCAN_TRY(StationConfig config, LoadStationConfig(station));
  SCAN_TRY(const SimScene scene, MakeSimScene(config.sim.specimen));
  PlaceOnFoot(config.sim.placement, scene.specimen_bounds);
  SCAN_TRY(const auto views, PlanOfStation(config));
  const SimWorld world(config);
  SCAN_CHECK(PrepareOutputFolder(out, true));

  const CameraConfig& camera = config.cameras.front();
  SCAN_TRY(const EncodedFile elsewhere,
           EncodePicture(cv::Mat(camera.h, camera.w, CV_8UC3, cv::Scalar(255, 0, 255)), "jpg", 92));
  SCAN_CHECK(WriteFileDurably(out / "elsewhere.jpg", elsewhere.bytes));
  std::string index;
  Json truth = {{"views", Json::object()}};
  int number = 0;
  for (const PlannedView& view : views) {
    TrueState state = StateOf(config, world, view);
    const Intrinsics& in = state.intrinsics;
    truth.update(
        {{"fx", in.fl_x}, {"fy", in.fl_y}, {"cx", in.cx}, {"cy", in.cy}, {"w", in.w}, {"h", in.h}});
    truth["views"][view.id] = JsonRows(state.camera_from_model.matrix34());
    for (const bool present : {true, false}) {
      state.specimen_present = present;
      SCAN_TRY(const cv::Mat picture, scene.renderer(state));
      SCAN_TRY(const EncodedFile jpeg, EncodePicture(picture, "jpg", 92));
      const std::string name = fmt::format("{}.jpg", number++);
      SCAN_CHECK(WriteFileDurably(out / name, jpeg.bytes));
      index += fmt::format("{} {} {} {}\n", StepsAt(config.turntable, view.turntable_deg),
                           StepsAt(config.lift, view.lift_mm), present ? 1 : 0, name);
    }
  }
  SCAN_CHECK(WriteFileDurably(out / "truth.json", truth.dump(1)));
  SCAN_TRY(const auto specimen, MakeSpecimen(config.sim.specimen));
  SCAN_CHECK(WritePly(out / "surface.ply", ExactSurface(*specimen, 0.3)));
  return WriteFileDurably(out / "index", index);  // last: it says that all is there
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "usage: lab_pictures STATION OUT\n");
    return 2;
  }
  if (const Status made = MakePictures(argv[1], argv[2]); !made) {
    fmt::print(stderr, "lab_pictures: {}\n", ToString(made.error()));
    return 1;
  }
  return 0;
}
