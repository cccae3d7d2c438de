// Devices that fail at the N-th call, around any station: every call of every device counts.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "drivers/station/station.h"

namespace scan {

// Shared by the devices of one station. Calls count from 1.
struct CallPlan {
  int calls = 0;
  int fail_at = 0;                       // 0: none
  int fail_count = 1;                    // so many in a row
  std::function<void(int)> before_call;  // for cancelling at a call

  bool Next() {
    ++calls;
    if (before_call) before_call(calls);
    return fail_at > 0 && calls >= fail_at && calls < fail_at + fail_count;
  }
};

inline tl::unexpected<Error> Injected(const std::string& where) {
  return DeviceFault("injected fault", where, "none: a test does this");
}

class FailingMotion final : public Motion {
 public:
  FailingMotion(std::unique_ptr<Motion> inner, std::shared_ptr<CallPlan> plan)
      : inner_(std::move(inner)), plan_(std::move(plan)) {}
  Result<HomeReport> Home(std::stop_token stop) override {
    if (plan_->Next()) return Injected("motion");
    return inner_->Home(stop);
  }
  Result<MoveReport> MoveTo(const StageTarget& target, std::stop_token stop) override {
    if (plan_->Next()) return Injected("motion");
    return inner_->MoveTo(target, stop);
  }
  Status Stop() override { return inner_->Stop(); }
  Status Abort() override { return inner_->Abort(); }
  MotionStatus ReadStatus() override { return inner_->ReadStatus(); }

 private:
  std::unique_ptr<Motion> inner_;
  std::shared_ptr<CallPlan> plan_;
};

class FailingCamera final : public Camera {
 public:
  FailingCamera(std::unique_ptr<Camera> inner, std::shared_ptr<CallPlan> plan)
      : inner_(std::move(inner)), plan_(std::move(plan)) {}
  const CameraInfo& Info() const override { return inner_->Info(); }
  Result<AppliedSettings> Configure(const CameraSettings& settings) override {
    if (plan_->Next()) return Injected("camera " + Info().id);
    return inner_->Configure(settings);
  }
  Result<Frame> Grab(std::stop_token stop) override {
    if (plan_->Next()) return Injected("camera " + Info().id);
    return inner_->Grab(stop);
  }

 private:
  std::unique_ptr<Camera> inner_;
  std::shared_ptr<CallPlan> plan_;
};

class FailingLight final : public Light {
 public:
  FailingLight(std::unique_ptr<Light> inner, std::shared_ptr<CallPlan> plan)
      : inner_(std::move(inner)), plan_(std::move(plan)) {}
  Status Set(bool on) override {
    if (plan_->Next()) return Injected("light");
    return inner_->Set(on);
  }

 private:
  std::unique_ptr<Light> inner_;
  std::shared_ptr<CallPlan> plan_;
};

inline Station MakeFailing(Station station, const std::shared_ptr<CallPlan>& plan) {
  station.motion = std::make_unique<FailingMotion>(std::move(station.motion), plan);
  for (auto& [id, camera] : station.cameras)
    camera = std::make_unique<FailingCamera>(std::move(camera), plan);
  station.light = std::make_unique<FailingLight>(std::move(station.light), plan);
  return station;
}

}  // namespace scan
