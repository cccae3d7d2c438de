#include "drivers/station/sim_station.h"

#include <cmath>

#include "drivers/io/sim/sim_light.h"
#include "drivers/motion/sim/sim_step_port.h"
#include "drivers/motion/stepper_motion.h"

namespace scan {
namespace {

class SimAim final : public AimPreset {
 public:
  SimAim(std::shared_ptr<SimWorld> world, std::vector<std::string> ids)
      : world_(std::move(world)), ids_(std::move(ids)) {}
  std::vector<std::string> Ids() const override { return ids_; }
  std::string Current() const override { return world_->aim(); }
  Status GoTo(const std::string& id) override {
    world_->SetAim(id);
    return {};
  }

 private:
  std::shared_ptr<SimWorld> world_;
  std::vector<std::string> ids_;
};

}  // namespace

std::unique_ptr<Motion> MakeSimMotion(const StationConfig& config,
                                      const std::shared_ptr<SimWorld>& world,
                                      const std::shared_ptr<Clock>& clock) {
  std::vector<std::string> aim_ids;
  for (const AimConfig& aim : config.aims) aim_ids.push_back(aim.id);
  StepperMotion::Parts parts;
  parts.clock = clock;
  parts.turntable = std::make_unique<Axis>(
      config.turntable, std::make_unique<SimStepPort>(world->turntable(), config.turntable.name));
  parts.lift = std::make_unique<Axis>(
      config.lift, std::make_unique<SimStepPort>(world->lift(), config.lift.name));
  parts.aim = std::make_unique<SimAim>(world, std::move(aim_ids));
  return std::make_unique<StepperMotion>(std::move(parts));
}

Result<Station> MakeSimStation(const StationConfig& config, const std::shared_ptr<SimWorld>& world,
                               const std::shared_ptr<Clock>& clock, SceneRenderer renderer,
                               TruthSink truth_sink) {
  SCAN_CHECK(Validate(config));
  Station station;
  station.clock = clock;
  station.motion = MakeSimMotion(config, world, clock);
  station.light = std::make_unique<SimLight>([world](bool on) { world->SetLight(on); });
  for (const CameraConfig& camera : config.cameras) {
    SimCameraOptions options;
    options.info = {camera.id, camera.model, camera.w, camera.h};
    options.exposure_us = camera.exposure_us;
    options.gain = camera.gain;
    options.seed = config.sim.seed + 0x1000003 * (station.cameras.size() + 1);
    options.noise = config.sim.noise;
    options.format = config.sim.format;
    options.jpeg_quality = config.sim.jpeg_quality;
    options.frame_interval_ns = std::llround(config.sim.frame_interval_ms * 1e6);
    options.settings_delay_frames = config.sim.settings_delay_frames;
    options.late_frames = config.sim.errors.late_frames;
    station.cameras[camera.id] = std::make_unique<SimCamera>(
        std::move(options), clock,
        [world, id = camera.id](std::int64_t mono_ns) { return world->StateAt(id, mono_ns); },
        renderer, truth_sink);
  }
  return station;
}

}  // namespace scan
