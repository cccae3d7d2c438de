// The lamp's simulated twin.
#pragma once

#include <functional>
#include <utility>

#include "drivers/io/light.h"

namespace scan {

// Tells the simulated world; thread-safe as far as `on_set` is.
class SimLight final : public Light {
 public:
  explicit SimLight(std::function<void(bool)> on_set) : on_set_(std::move(on_set)) {}
  Status Set(bool on) override {
    on_set_(on);
    return {};
  }

 private:
  std::function<void(bool)> on_set_;
};

}  // namespace scan
