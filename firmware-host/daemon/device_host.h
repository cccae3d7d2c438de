// The real station: cameras of this process or of workers that it starts, motion and lamp in
// scanstation-motiond.
#pragma once

#include <filesystem>
#include <memory>

#include "drivers/base/result.h"
#include "drivers/station/station_config.h"
#include "firmware-host/daemon/operator_prompt.h"
#include "firmware-host/daemon/station_host.h"

namespace scan {

// The specimen is taken off and put back by a person, asked through `operator_prompt`. A
// station without a lamp has the room's light, which is on as long as somebody leaves it so.
class DeviceHost final : public StationHost {
 public:
  // Preconditions: the configuration is valid; `operator_prompt` outlives the host.
  // Errors: bad_input for a configuration with simulated parts, or another one than
  // scanstation-motiond has read (`config_sha256`); device for what does not answer.
  static Result<std::unique_ptr<DeviceHost>> Start(const StationConfig& config,
                                                   const std::string& config_sha256,
                                                   const std::filesystem::path& motion_socket,
                                                   OperatorPrompt& operator_prompt);

  Station& station() override { return station_; }
  SpecimenPrompt prompt() override;
  std::optional<BoundingCylinder> specimen_bounds() const override { return {}; }

 private:
  explicit DeviceHost(OperatorPrompt& operator_prompt) : operator_prompt_(operator_prompt) {}

  OperatorPrompt& operator_prompt_;
  Station station_;
};

}  // namespace scan
