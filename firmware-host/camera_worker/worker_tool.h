// A worker program run once for one answer, without a camera session.
#pragma once

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "drivers/base/result.h"

namespace scan {

// Prints what RunWorkerTool understands on standard output; the exit code.
int PrintToolAnswer(const Result<nlohmann::json>& answer);

// Runs `program`; its answer, or its error. Errors also: device, when it died, answered nonsense,
// or did not end within `limit`: then it is killed.
Result<nlohmann::json> RunWorkerTool(const std::filesystem::path& program,
                                     const std::vector<std::string>& arguments,
                                     std::chrono::milliseconds limit);

}  // namespace scan
