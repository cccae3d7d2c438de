// libcamera's pixel formats as those that become pictures here.
#pragma once

#include <string_view>

#include "drivers/camera/v4l2/pixel_format.h"

namespace scan {

// By libcamera's name ("RGB888" is B, G, R in memory). Null for what is not understood.
const PixelFormat* FindLibcameraFormat(std::string_view name);

}  // namespace scan
