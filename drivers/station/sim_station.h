// A station of simulated devices over one world and one clock.
#pragma once

#include <memory>

#include "drivers/base/clock.h"
#include "drivers/camera/sim/sim_camera.h"
#include "drivers/motion/motion.h"
#include "drivers/station/sim_world.h"
#include "drivers/station/station.h"
#include "drivers/station/station_config.h"

namespace scan {

// Only the motion half: what the motion daemon hosts.
std::unique_ptr<Motion> MakeSimMotion(const StationConfig& config,
                                      const std::shared_ptr<SimWorld>& world,
                                      const std::shared_ptr<Clock>& clock);

// All devices, cameras by id. The truth of every frame goes to `truth_sink` (may be empty).
// Errors: bad_input when the configuration is not valid.
Result<Station> MakeSimStation(const StationConfig& config, const std::shared_ptr<SimWorld>& world,
                               const std::shared_ptr<Clock>& clock, SceneRenderer renderer,
                               TruthSink truth_sink = {});

}  // namespace scan
