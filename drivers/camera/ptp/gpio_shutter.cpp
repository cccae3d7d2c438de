#include "drivers/camera/ptp/gpio_shutter.h"

#include <array>

namespace scan {
namespace {

constexpr int kMaxEdges = 1000;  // a contact that never comes to rest must not hold us up

class GpioShutter final : public ShutterLines {
 public:
  GpioShutter(std::unique_ptr<GpioLines> release, std::unique_ptr<GpioLines> hot_shoe)
      : release_(std::move(release)), hot_shoe_(std::move(hot_shoe)) {}
  ~GpioShutter() override {
    if (release_) (void)Press(false);
  }

  bool has_release() const override { return release_ != nullptr; }
  bool has_hot_shoe() const override { return hot_shoe_ != nullptr; }

  Status Press(bool pressed) override { return release_->Set(std::array{GpioLevel{0, pressed}}); }

  Result<std::vector<std::int64_t>> TakeHotShoe() override {
    std::vector<std::int64_t> closed_ns;
    for (int k = 0; k < kMaxEdges; ++k) {
      SCAN_TRY(const auto edge, hot_shoe_->WaitEdge(0));
      if (!edge) return closed_ns;
      if (edge->active) closed_ns.push_back(edge->mono_ns);
    }
    return DeviceFault("the flash contact never comes to rest", "hot-shoe line",
                       "wire it through an optocoupler, with the pull-up that the line needs");
  }

 private:
  std::unique_ptr<GpioLines> release_, hot_shoe_;
};

GpioRequest RequestOf(const PtpConfig& config, GpioLineConfig line) {
  return {config.gpio_chip, "scanstation-camera", {std::move(line)}};
}

}  // namespace

Result<std::unique_ptr<ShutterLines>> OpenGpioShutter(const PtpConfig& config,
                                                      const GpioOpener& open) {
  std::unique_ptr<GpioLines> release, hot_shoe;
  if (!config.release_line.empty()) {
    GpioLineConfig line{.name = config.release_line};
    line.output = true;
    line.active_low = config.release_active_low;
    SCAN_TRY(release, open(RequestOf(config, line)));
  }
  if (!config.hot_shoe_line.empty()) {
    GpioLineConfig line{.name = config.hot_shoe_line};
    line.active_low = config.hot_shoe_active_low;
    line.bias = config.hot_shoe_active_low ? GpioBias::pull_up : GpioBias::pull_down;
    line.edges = true;
    SCAN_TRY(hot_shoe, open(RequestOf(config, line)));
  }
  if (!release && !hot_shoe) return std::unique_ptr<ShutterLines>();
  return std::unique_ptr<ShutterLines>(
      std::make_unique<GpioShutter>(std::move(release), std::move(hot_shoe)));
}

}  // namespace scan
