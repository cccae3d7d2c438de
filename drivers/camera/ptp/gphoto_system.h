// Tethered cameras of this machine, through libgphoto2.
#pragma once

#include <memory>

#include "drivers/camera/ptp/photo_system.h"

namespace scan {

// Loads libgphoto2's drivers. libgphoto2 may hang in any call, so this belongs in a process that
// can be killed. Errors: refused, when there are none.
PhotoResult<std::unique_ptr<PhotoSystem>> MakeGphotoSystem();

}  // namespace scan
