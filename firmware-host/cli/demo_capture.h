// A synthetic specimen on the simulated station: its session, its truth and its CT volume.
#pragma once

#include <filesystem>
#include <string>

#include "drivers/base/result.h"
#include "firmware-host/cli/command.h"

namespace scan {

struct DemoPaths {
  std::filesystem::path session, volume, model, truth, log, config;
};
DemoPaths DemoPathsIn(const std::filesystem::path& folder);

// Captures the way every capture goes: through a scanstationd of its own, which ends with this.
// `errors`: ideal, static or dynamic. Writes session, truth, log and the station's configuration.
// Errors: those of the daemon; failed when it does not start; cancelled.
Status CaptureDemo(const DemoPaths& paths, const std::string& specimen, const std::string& errors,
                   const CliContext& context);

// The grey-value volume that a scanner would make of the specimen. Errors: bad_input for an unknown
// specimen, failed when the file cannot be written.
Status MakeDemoCt(const DemoPaths& paths, const std::string& specimen);

}  // namespace scan
