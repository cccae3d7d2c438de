// All roles of a simulated station in one process: the composition root of the simulation.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <thread>

#include "acquisition/runner/runner.h"
#include "drivers/base/result.h"
#include "drivers/station/sim_station.h"
#include "drivers/station/station_config.h"
#include "firmware-host/daemon/sim_scene.h"
#include "firmware-host/daemon/station_host.h"
#include "firmware-host/protocol/channel.h"

namespace scan {

// One SimWorld, one virtual clock; motion is reached over the protocol of scanstation-motiond,
// served by a thread of this process. Only one role works at a time (the runner waits for each
// answer), so virtual time never runs ahead of a role that still has work to do.
class SimHost final : public StationHost {
 public:
  // `truth` (may be empty): a file that gets one JSON line a frame with the true camera.
  // Errors: bad_input for the configuration or the truth file.
  static Result<std::unique_ptr<SimHost>> Start(StationConfig config,
                                                const std::filesystem::path& truth);
  ~SimHost() override;

  Station& station() override { return station_; }
  // Takes the specimen off the platter for the background plates and puts it back.
  SpecimenPrompt prompt() override;
  std::optional<BoundingCylinder> specimen_bounds() const override { return specimen_bounds_; }

 private:
  SimHost() = default;

  std::shared_ptr<SimWorld> world_;
  std::unique_ptr<Motion> motion_;  // the real one, behind the protocol
  std::unique_ptr<Channel> channel_;
  std::jthread motion_server_;
  Station station_;
  BoundingCylinder specimen_bounds_;
};

}  // namespace scan
