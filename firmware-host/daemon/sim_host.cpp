#include "firmware-host/daemon/sim_host.h"

#include <array>
#include <fstream>

#include "acquisition/session/document_json.h"
#include "drivers/base/virtual_clock.h"
#include "drivers/station/geometry.h"
#include "firmware-host/protocol/motion_client.h"
#include "firmware-host/protocol/motion_server.h"
#include "firmware-host/protocol/socket.h"

namespace scan {
namespace {

BoundingCylinder CylinderAround(const BoundingBox& bounds, const TableFromModel& table_from_model) {
  BoundingCylinder cylinder{.radius_mm = 0, .z_low_mm = 1e9, .z_high_mm = -1e9};
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p =
        table_from_model * Eigen::Vector3d(corner & 1 ? bounds.high.x() : bounds.low.x(),
                                           corner & 2 ? bounds.high.y() : bounds.low.y(),
                                           corner & 4 ? bounds.high.z() : bounds.low.z());
    cylinder.radius_mm = std::max(cylinder.radius_mm, p.head<2>().norm());
    cylinder.z_low_mm = std::min(cylinder.z_low_mm, p.z());
    cylinder.z_high_mm = std::max(cylinder.z_high_mm, p.z());
  }
  return cylinder;
}

Json TruthLine(const FrameTruth& frame) {
  return {{"camera", frame.camera_id},
          {"sensor_sequence", frame.sensor_sequence},
          {"camera_from_model", JsonRows(frame.state.camera_from_model.matrix34())},
          {"intrinsics", Json(ToJson(frame.state.intrinsics))}};
}

Result<TruthSink> MakeTruthSink(const std::filesystem::path& path) {
  if (path.empty()) return TruthSink();
  auto file = std::make_shared<std::ofstream>(path, std::ios::trunc);
  if (!*file) return BadInput("cannot write the truth file", path.string(), "name another --truth");
  return TruthSink([file](const FrameTruth& frame) { *file << TruthLine(frame) << std::endl; });
}

}  // namespace

Result<std::unique_ptr<SimHost>> SimHost::Start(StationConfig config,
                                                const std::filesystem::path& truth) {
  for (const CameraConfig& camera : config.cameras) {
    if (camera.driver != CameraDriver::sim)
      return BadInput("camera " + camera.id + " is a real one, and the axes are simulated",
                      "camera.driver", "simulate the camera too: driver = \"sim\"");
  }
  SCAN_TRY(const SimScene scene, MakeSimScene(config.sim.specimen));
  SCAN_TRY(TruthSink truth_sink, MakeTruthSink(truth));
  PlaceOnFoot(config.sim.placement, scene.specimen_bounds);
  SCAN_CHECK(Validate(config));

  std::unique_ptr<SimHost> host(new SimHost);
  host->world_ = std::make_shared<SimWorld>(config);
  const std::shared_ptr<Clock> clock = std::make_shared<VirtualClock>();
  SCAN_TRY(host->station_, MakeSimStation(config, host->world_, clock, scene.renderer, truth_sink));
  host->specimen_bounds_ = CylinderAround(scene.specimen_bounds, host->world_->table_from_model());

  SCAN_TRY(auto sockets, SocketPair());
  host->channel_ = std::make_unique<Channel>(std::move(sockets.first));
  host->motion_ = std::move(host->station_.motion);
  host->motion_server_ = std::jthread([raw = host.get()](std::stop_token stop) {
    ServeMotion(*raw->channel_, *raw->motion_, stop);
  });
  host->station_.motion = std::make_unique<MotionClient>(std::move(sockets.second));
  return host;
}

SimHost::~SimHost() { station_.motion.reset(); }

SpecimenPrompt SimHost::prompt() {
  return [world = world_](SpecimenAction action, std::stop_token) -> Result<PromptAnswer> {
    world->SetSpecimenPresent(action == SpecimenAction::place);
    return PromptAnswer{.confirmed = true, .note = "simulated"};
  };
}

}  // namespace scan
