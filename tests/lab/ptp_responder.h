// A still camera as a USB gadget: answers PTP (PIMA 15740 over USB) through FunctionFS.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "drivers/base/result.h"

namespace scan {

// What is asked for the picture of an exposure.
struct PtpShot {
  std::uint32_t number = 0;  // from 1
  double exposure_us = 0;
};

// The JPEG of an exposure, of what stands before the camera when it ends; empty: none is taken.
using PtpPainter = std::function<std::vector<std::uint8_t>(const PtpShot&)>;

class PtpResponder {
 public:
  // `folder`: where FunctionFS is mounted; the gadget may be bound when this returns.
  // Errors: device.
  static Result<std::unique_ptr<PtpResponder>> Open(const std::string& folder, PtpPainter painter);
  ~PtpResponder();
  // Answers the host. Never ends; being unplugged and plugged in again is nothing to it.
  [[noreturn]] void Run();

 private:
  class Impl;
  explicit PtpResponder(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace scan
