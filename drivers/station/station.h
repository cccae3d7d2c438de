// The owned set of devices of one station, as the runner sees it.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "drivers/base/clock.h"
#include "drivers/camera/camera.h"
#include "drivers/io/light.h"
#include "drivers/motion/motion.h"

namespace scan {

struct Station {
  std::shared_ptr<Clock> clock;
  std::unique_ptr<Motion> motion;
  std::map<std::string, std::unique_ptr<Camera>> cameras;  // by camera id
  std::unique_ptr<Light> light;
};

}  // namespace scan
