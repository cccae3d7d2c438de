// A small simulated station and the request to capture with it.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "acquisition/plan/station_plan.h"
#include "acquisition/runner/runner.h"
#include "drivers/base/virtual_clock.h"
#include "drivers/station/sim_station.h"
#include "tests/support/ellipsoid_scene.h"

namespace scan {

struct SimCaptureOptions {
  int w = 96, h = 64;
  int views_a_ring = 3;
  int late_frames = 0;
  std::string format = "png";
  ErrorLevel level = ErrorLevel::dynamic;
};

inline StationConfig SmallSimStation(const SimCaptureOptions& options) {
  StationConfig config = DefaultSimStation();
  config.sim.errors = DefaultSimErrors(options.level);
  config.sim.errors.late_frames = options.late_frames;
  config.sim.format = options.format;
  config.cameras[0].w = options.w;
  config.cameras[0].h = options.h;
  for (RingConfig& ring : config.plan.rings) ring.count = options.views_a_ring;
  return config;
}

// World, clock and station of one process; the world lives as long as its devices.
struct SimCapture {
  explicit SimCapture(const SimCaptureOptions& options = {}) : config(SmallSimStation(options)) {
    world = std::make_shared<SimWorld>(config);
    clock = std::make_shared<VirtualClock>();
    auto made = MakeSimStation(config, world, clock, RenderEllipsoidScene);
    if (!made) throw std::runtime_error(ToString(made.error()));
    station = std::move(*made);
  }

  CaptureRequest Request(const std::filesystem::path& folder) const {
    CaptureRequest request;
    request.folder = folder;
    request.document.id = "s0";
    request.document.software.version = "test";
    request.document.specimen["dwc:catalogNumber"] = "ellipsoid";
    request.document.station = DescribeStation(config);
    request.document.views = PlanOfStation(config).value();
    request.prompt = [world = world](SpecimenAction action,
                                     std::stop_token stop) -> Result<PromptAnswer> {
      if (stop.stop_requested()) return Cancelled("specimen prompt");
      world->SetSpecimenPresent(action == SpecimenAction::place);
      return PromptAnswer{true, "simulated"};
    };
    return request;
  }

  StationConfig config;
  std::shared_ptr<SimWorld> world;
  std::shared_ptr<VirtualClock> clock;
  Station station;
};

template <class T>
testing::AssertionResult Ok(const Result<T>& result) {
  if (result) return testing::AssertionSuccess();
  return testing::AssertionFailure() << ToString(result.error());
}

}  // namespace scan
