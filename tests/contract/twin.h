// What the contract suites need of a twin: the device, its clock, and whatever keeps it alive.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <ostream>
#include <string>

#include "drivers/base/activity.h"
#include "drivers/base/clock.h"
#include "drivers/camera/camera.h"
#include "drivers/io/light.h"
#include "drivers/motion/motion.h"

namespace scan {

template <class Device>
struct Twin {
  std::shared_ptr<void> world;  // destroyed last
  std::shared_ptr<Clock> clock;
  Activity* activity = nullptr;  // of a virtual clock; null where time runs by itself
  std::unique_ptr<Device> device;
};

template <class Device>
struct TwinFactory {
  std::string name;
  std::function<Twin<Device>()> make;
  friend std::ostream& operator<<(std::ostream& out, const TwinFactory& factory) {
    return out << factory.name;
  }
};

template <class Device>
class DeviceContract : public ::testing::TestWithParam<TwinFactory<Device>> {
 protected:
  void SetUp() override {
    twin = this->GetParam().make();
    ASSERT_TRUE(twin.device);
  }
  Device& device() { return *twin.device; }
  Clock& clock() { return *twin.clock; }
  Twin<Device> twin;
};

// Positive angles in [0, 40] degrees and heights in [0, 20] mm are within every twin's limits.
class MotionContract : public DeviceContract<Motion> {};
class CameraContract : public DeviceContract<Camera> {};
class LightContract : public DeviceContract<Light> {};
class ClockContract : public ::testing::TestWithParam<TwinFactory<Clock>> {};

}  // namespace scan
