// Feeds the UVC gadget of guest/uvc.sh, so that the guest's uvcvideo sees a camera at work.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "drivers/base/result.h"

namespace scan {

// What the camera at work has been asked for.
struct GadgetFrame {
  int w = 0, h = 0;
  bool jpeg = false;         // else YUYV
  std::uint32_t number = 0;  // pictures sent before
  int exposure = 0;          // the control exposure_time_absolute, 100 us
};

// Draws into the buffer and says how many bytes it took; 0: nothing is sent now.
using GadgetPainter = std::function<std::size_t(const GadgetFrame&, std::span<std::uint8_t>)>;

class UvcGadget {
 public:
  // Errors: device, where there is no gadget.
  static Result<std::unique_ptr<UvcGadget>> Open(GadgetPainter painter);
  ~UvcGadget();
  // Answers the host and sends pictures at the rate it chose. Never ends.
  [[noreturn]] void Run();

 private:
  class Feeder;
  explicit UvcGadget(std::unique_ptr<Feeder> feeder);
  std::unique_ptr<Feeder> feeder_;
};

}  // namespace scan
