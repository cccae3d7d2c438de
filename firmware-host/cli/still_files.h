// Stills taken by hand: what all drivers' commands ask for alike, and the files that come of it.
#pragma once

#include <filesystem>
#include <stop_token>
#include <string>
#include <utility>

#include "drivers/camera/camera.h"
#include "firmware-host/cli/command.h"

namespace scan {

struct StillOptions {
  double exposure_us = 0, gain = 0;  // 0: as it is
  std::filesystem::path out;         // still-3.jpg where several are taken
  int count = 1;
  bool force = false;  // overwrite files
};

// --out --exposure-us --count --force. Precondition: `options` lives as long as the command.
void AddStillOptions(CLI::App& grab, StillOptions& options);

// Sets what is asked for and takes the stills; every file of a frame is written, with the picture's
// own extension. Errors: those of the camera and of writing.
Result<CommandOutput> TakeStills(Camera& camera, const StillOptions& options, std::stop_token stop);

// "640x480". Errors: bad_input.
Result<std::pair<int, int>> ReadSize(const std::string& text);

// "NAME=VALUE". Errors: bad_input.
Result<std::pair<std::string, std::string>> SplitAssignment(const std::string& text);

}  // namespace scan
