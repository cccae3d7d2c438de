#include "drivers/io/gpio/gpio_lamp.h"

#include <fmt/format.h>

#include <mutex>

namespace scan {
namespace {

class GpioLamp final : public Lamp {
 public:
  GpioLamp(std::unique_ptr<GpioLines> line, std::string name)
      : line_(std::move(line)), name_(std::move(name)) {}
  ~GpioLamp() override { (void)SetLevel(0); }

  Status SetLevel(double level) override {
    if (level != 0 && level != 1) {
      return BadInput(fmt::format("a line is on or off, and has no level {}", level),
                      "light " + name_, "give 0 or 1, or put the lamp on a PWM output");
    }
    std::lock_guard lock(mutex_);
    const GpioLevel set{0, level == 1};
    return line_->Set({&set, 1});
  }

 private:
  std::unique_ptr<GpioLines> line_;
  const std::string name_;
  std::mutex mutex_;
};

}  // namespace

Result<std::unique_ptr<Lamp>> OpenGpioLamp(const GpioOpener& open, const std::string& chip,
                                           const GpioPin& pin) {
  const GpioLineConfig output{pin.name, true, pin.active_low, false, GpioBias::as_is, false};
  SCAN_TRY(auto line, open({chip, "scanstation light", {output}}));
  return std::make_unique<GpioLamp>(std::move(line), pin.name);
}

}  // namespace scan
