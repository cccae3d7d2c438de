#include "drivers/motion/gpio/gpio_step_port.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace scan {
namespace {

std::int64_t NsFromUs(double us) { return std::llround(us * 1e3); }

GpioLineConfig Output(const GpioPin& pin, bool initial) {
  return {pin.name, true, pin.active_low, initial, GpioBias::as_is, false};
}

}  // namespace

Result<std::unique_ptr<GpioStepPort>> GpioStepPort::Open(
    const GpioOpener& open, const std::string& chip, const std::string& axis,
    const GpioAxisWiring& wiring, Switches switches, std::shared_ptr<Clock> clock) {
  std::unique_ptr<GpioStepPort> port(new GpioStepPort);
  port->axis_ = axis;
  port->wiring_ = wiring;
  port->switches_ = std::move(switches);
  port->clock_ = std::move(clock);
  GpioRequest control{chip, "scanstation " + axis, {Output(wiring.direction, false)}};
  if (wiring.enable) {
    port->enable_line_ = control.lines.size();
    control.lines.push_back(Output(wiring.enable, false));
  }
  if (wiring.brake) {
    port->brake_line_ = control.lines.size();
    control.lines.push_back(Output(wiring.brake, true));
  }
  SCAN_TRY(port->control_, open(control));
  SCAN_TRY(port->step_,
           open({chip, "scanstation " + axis + " step", {Output(wiring.step, false)}}));
  return port;
}

GpioStepPort::~GpioStepPort() {
  if (control_) (void)SetControl(brake_line_, true);
}

Status GpioStepPort::SetControl(std::optional<std::size_t> line, bool active) {
  if (!line) return {};
  const GpioLevel level{*line, active};
  return control_->Set({&level, 1});
}

Status GpioStepPort::Enable(bool on) {
  if (on) {  // a new motion: what the switches did before is past
    for (const auto& input : {switches_.endstop, switches_.index}) {
      if (input) switches_.watch->Forgive(*input);
    }
  }
  if (on == enabled_) return {};
  enabled_.reset();
  SCAN_CHECK(SetControl(enable_line_, on));
  enabled_ = on;
  const std::int64_t ready_ns = clock_->Now().mono_ns + NsFromUs(wiring_.enable_ms * 1e3);
  if (on) settled_ns_ = std::max(settled_ns_, ready_ns);
  return {};
}

Status GpioStepPort::Brake(bool on) {
  if (on == braked_) return {};
  braked_.reset();
  SCAN_CHECK(SetControl(brake_line_, on));
  braked_ = on;
  return {};
}

Status GpioStepPort::SetDirection(bool positive) {
  if (positive_ == positive) return {};
  clock_->SleepUntil(hold_ns_);
  positive_.reset();
  const GpioLevel level{0, positive};
  SCAN_CHECK(control_->Set({&level, 1}));
  positive_ = positive;
  settled_ns_ = std::max(settled_ns_, clock_->Now().mono_ns + NsFromUs(wiring_.setup_us));
  return {};
}

Status GpioStepPort::EmitEdge(std::int64_t) {
  clock_->SleepUntil(settled_ns_);
  const GpioLevel active{0, true}, inactive{0, false};
  SCAN_CHECK(step_->Set({&active, 1}));
  const std::int64_t pulse_ns = NsFromUs(wiring_.pulse_us);
  clock_->SleepUntil(clock_->Now().mono_ns + pulse_ns);
  SCAN_CHECK(step_->Set({&inactive, 1}));
  const std::int64_t now_ns = clock_->Now().mono_ns;
  settled_ns_ = now_ns + pulse_ns;
  hold_ns_ = now_ns + NsFromUs(wiring_.setup_us);
  return {};
}

Result<bool> GpioStepPort::Switch(std::optional<std::size_t> input, const char* kind) {
  if (input) return switches_.watch->Read(*input);
  return DeviceFault(fmt::format("no {} is wired", kind), axis_,
                     fmt::format("name its line in axis.{}.gpio.{}", axis_, kind));
}

Result<bool> GpioStepPort::Endstop() { return Switch(switches_.endstop, "endstop"); }
Result<bool> GpioStepPort::Index() { return Switch(switches_.index, "index"); }

}  // namespace scan
