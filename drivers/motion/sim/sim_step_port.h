// The step port's simulated twin: edges go to whatever integrates them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "drivers/motion/step_port.h"

namespace scan {

// The physics of one axis, as its driver feels it. Thread contract: any thread.
class AxisPhysics {
 public:
  virtual ~AxisPhysics() = default;
  virtual void OnPower(bool on) = 0;
  virtual void OnEdge(bool positive, std::int64_t mono_ns) = 0;
  virtual bool Endstop() const = 0;
  virtual bool Index() const = 0;
};

// What is broken about a simulated port.
struct StepPortFaults {
  enum class Switch { works, stuck_active, disconnected };
  Switch home_switch = Switch::works;
  std::int64_t fail_at_edge = 0;  // the N-th edge answers with a device fault; 0 never
};

class SimStepPort final : public StepPort {
 public:
  SimStepPort(std::shared_ptr<AxisPhysics> physics, std::string name, StepPortFaults faults = {})
      : physics_(std::move(physics)), name_(std::move(name)), faults_(faults) {}

  Status Enable(bool on) override {
    physics_->OnPower(on);
    return {};
  }
  Status Brake(bool) override { return {}; }
  Status SetDirection(bool positive) override {
    positive_ = positive;
    return {};
  }
  Status EmitEdge(std::int64_t deadline_ns) override {
    if (++edges_ == faults_.fail_at_edge) {
      return DeviceFault("simulated fault of the step line", name_, "home the stage");
    }
    physics_->OnEdge(positive_, deadline_ns);
    return {};
  }
  Result<bool> Endstop() override { return Read(physics_->Endstop()); }
  Result<bool> Index() override { return Read(physics_->Index()); }

 private:
  bool Read(bool value) const {
    if (faults_.home_switch == StepPortFaults::Switch::works) return value;
    return faults_.home_switch == StepPortFaults::Switch::stuck_active;
  }

  std::shared_ptr<AxisPhysics> physics_;
  std::string name_;
  StepPortFaults faults_;
  bool positive_ = true;
  std::int64_t edges_ = 0;
};

}  // namespace scan
