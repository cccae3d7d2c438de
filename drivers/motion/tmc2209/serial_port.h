// A serial line, as a protocol on it needs it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "drivers/base/result.h"

namespace scan {

// Thread contract: one thread at a time. Errors: device faults that name the line.
class SerialPort {
 public:
  virtual ~SerialPort() = default;
  virtual Status Write(std::span<const std::uint8_t> bytes) = 0;
  // Up to `count` bytes; fewer when `timeout_ms` passes without one more.
  virtual Result<std::vector<std::uint8_t>> Read(std::size_t count, int timeout_ms) = 0;
  // Forgets what has arrived and was not read.
  virtual Status Discard() = 0;
};

using SerialOpener = std::function<Result<std::unique_ptr<SerialPort>>(const std::string& path)>;

// A line of the kernel: 115200 baud, 8N1, raw, for this program alone.
Result<std::unique_ptr<SerialPort>> OpenSerialPort(const std::string& path);

}  // namespace scan
