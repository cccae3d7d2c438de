// The settings that a run rests on: set, read back, held at every frame.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/base/clock.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/ptp/photo_system.h"
#include "drivers/camera/ptp/ptp_config.h"

namespace scan {

// Thread contract: one thread at a time. Must not outlive camera and clock.
class PtpSettings {
 public:
  // Handles the events that come meanwhile, for at most so long: some cameras take a setting over
  // only when their events are asked for.
  using Pump = std::function<PhotoStatus(int timeout_ms)>;

  // Reads which settings the camera has and plans those that configuration and `asked` want.
  // Errors: bad_input for a name or value that the camera does not have; device.
  static Result<PtpSettings> Plan(PhotoCamera& camera, const PtpConfig& config,
                                  const CameraSettings& asked, const std::string& where);

  // Sets what differs, reads back until it agrees. Gives what the camera says of exposure and gain.
  // Errors: device, for a setting that the camera does not keep, a mode dial or a lens that is not
  // on manual.
  Result<AppliedSettings> Hold(PhotoCamera& camera, Clock& clock, const Pump& pump) const;

  // Exposure and gain as the camera has them now.
  Result<AppliedSettings> Read(PhotoCamera& camera) const;

  int files_per_exposure() const { return files_; }
  bool into_ram() const { return into_ram_; }  // the camera keeps no copy of the picture

 private:
  struct Held {
    std::string name, value;
  };
  PtpSettings(const PtpConfig& config, std::string where)
      : config_(config), where_(std::move(where)) {}
  bool Has(const std::string& name) const;
  std::string FirstOf(std::initializer_list<const char*> names) const;
  Status PlanExposure(PhotoCamera& camera, const CameraSettings& asked);
  Status PlanPicture(PhotoCamera& camera);
  Status PlanFurther(PhotoCamera& camera);
  Status CheckManual(PhotoCamera& camera) const;
  Status HoldOne(PhotoCamera& camera, Clock& clock, const Pump& pump, const Held& held) const;
  Result<PhotoSetting> Get(PhotoCamera& camera, const std::string& name) const;

  PtpConfig config_;
  std::string where_;
  std::vector<std::string> names_;
  std::vector<Held> held_;
  std::string exposure_name_, iso_name_;
  bool exposure_driven_ = false;
  int files_ = 1;
  bool into_ram_ = false;
};

}  // namespace scan
