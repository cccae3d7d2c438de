// Which programs of this machine hold a USB device, or take every camera that they see.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace scan {

// Programs that have `node` (/dev/bus/usb/001/005) open, as far as this user may see, and the
// desktop's camera services, which take a camera as it is plugged in; without this process.
// "gvfsd-gphoto2 (812)", by process. `proc` is for tests. Thread contract: any thread.
std::vector<std::string> ProgramsTakingCamera(const std::filesystem::path& node,
                                              const std::filesystem::path& proc = "/proc");

// Whether one of these programs belongs to the desktop, for the way to mend it.
bool IsDesktopService(const std::string& program);

}  // namespace scan
