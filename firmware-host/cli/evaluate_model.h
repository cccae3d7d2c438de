// A finished model's poses beside cameras that others calibrated.
#pragma once

#include <filesystem>
#include <optional>

#include "drivers/base/result.h"
#include "firmware-host/cli/command.h"

namespace scan {

struct EvaluateModelOptions {
  std::filesystem::path model;    // folder of `reconstruct` or `pose`
  std::filesystem::path truth;    // calibrated cameras
  std::filesystem::path session;  // its photographs and masks
  std::filesystem::path mesh;     // empty: surface.ply of the model
  std::optional<double> exclude_below_mm;
};

// Errors: bad_input for a file that is missing or does not fit.
Result<CommandOutput> EvaluateModel(const EvaluateModelOptions& options, const CliContext& context);

}  // namespace scan
