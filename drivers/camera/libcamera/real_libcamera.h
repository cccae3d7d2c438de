// The machine's own libcamera. Only the worker program links it: its library changes its interface
// with every release and takes the process along when it crashes.
#pragma once

#include <memory>
#include <string>

#include "drivers/camera/libcamera/libcamera_system.h"

namespace scan {

// One at a time in a process. Errors of its calls carry libcamera's error codes.
std::shared_ptr<LibcameraSystem> MakeRealLibcamera();

// The version of the library that runs ("v0.0.3").
std::string LibcameraVersion();

}  // namespace scan
