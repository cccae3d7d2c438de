// A running stream: buffers mapped from the driver, frames leased one after the other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "drivers/base/clock.h"
#include "drivers/base/result.h"
#include "drivers/camera/v4l2/pixel_format.h"
#include "drivers/camera/v4l2/v4l2_device.h"

namespace scan {

enum class YcbcrMatrix { bt601, bt709, bt2020, smpte240m };

// What the driver agreed to.
struct StreamFormat {
  const PixelFormat* format = nullptr;  // never null
  int w = 0, h = 0;
  int bytes_per_line = 0;
  std::size_t size_image = 0;    // bytes of a buffer
  std::int64_t interval_ns = 0;  // between frames; 0 where the driver does not say
  YcbcrMatrix matrix = YcbcrMatrix::bt601;
  bool full_range = false;  // Y from 0 to 255; else from 16 to 235
};

// When a frame was stamped; monotonic, or not known.
enum class StampKind { start_of_frame, end_of_frame, none };

class V4l2Stream;

// A frame in the driver's own memory, given back to it on destruction; nothing is copied.
// Must not outlive its stream.
class MappedFrame {
 public:
  MappedFrame(MappedFrame&& other) noexcept;
  MappedFrame(const MappedFrame&) = delete;
  MappedFrame& operator=(const MappedFrame&) = delete;
  MappedFrame& operator=(MappedFrame&&) = delete;
  ~MappedFrame();

  std::span<const std::byte> bytes() const { return bytes_; }
  std::uint32_t buffer = 0;
  std::uint32_t sequence = 0;  // of the driver
  StampKind stamp = StampKind::none;
  std::int64_t stamp_ns = 0;
  bool flagged = false;  // the driver says that the data are damaged
  // The queue was seen empty at this instant, after every earlier frame: this one arrived later.
  std::int64_t arrived_after_ns = 0;
  std::int64_t taken_ns = 0;  // when it was taken out of the queue

 private:
  friend class V4l2Stream;
  MappedFrame(V4l2Stream* stream, std::span<const std::byte> bytes)
      : stream_(stream), bytes_(bytes) {}
  V4l2Stream* stream_;
  std::span<const std::byte> bytes_;
};

// A buffer as a dma-buf, for consumers that import it without a copy; closes its descriptor.
class DmaBuffer {
 public:
  DmaBuffer(std::shared_ptr<V4l2System> system, int fd) : system_(std::move(system)), fd_(fd) {}
  DmaBuffer(DmaBuffer&& other) noexcept
      : system_(std::move(other.system_)), fd_(std::exchange(other.fd_, -1)) {}
  DmaBuffer(const DmaBuffer&) = delete;
  DmaBuffer& operator=(const DmaBuffer&) = delete;
  ~DmaBuffer() {
    if (fd_ >= 0) system_->Close(fd_);
  }
  int fd() const { return fd_; }

 private:
  std::shared_ptr<V4l2System> system_;
  int fd_;
};

// Thread contract: one thread at a time. Must not outlive its device.
class V4l2Stream {
 public:
  // Sets format and frame interval, maps `buffers` buffers and starts.
  // Errors: bad_input for what the camera does not offer, device when a call fails or the driver
  // does not keep to the format.
  static Result<std::unique_ptr<V4l2Stream>> Start(std::shared_ptr<V4l2System> system,
                                                   V4l2Device& device, const FormatWish& wish,
                                                   std::uint32_t buffers);
  ~V4l2Stream();
  V4l2Stream(const V4l2Stream&) = delete;
  V4l2Stream& operator=(const V4l2Stream&) = delete;

  const StreamFormat& format() const { return format_; }

  // The next frame of the queue, or the first to come. Errors: device when none came until the
  // deadline or a call failed; cancelled, at most 50 ms after the request.
  Result<MappedFrame> Next(Clock& clock, std::int64_t deadline_ns, std::stop_token stop);

  // Errors: device where the driver offers none.
  Result<DmaBuffer> ExportDmaBuffer(std::uint32_t buffer);
  // The mapped memory of a buffer. Precondition: buffer < buffer_count().
  std::span<const std::byte> Memory(std::uint32_t buffer) const;
  std::uint32_t buffer_count() const { return static_cast<std::uint32_t>(mappings_.size()); }

  // Whether the driver still holds to the format that was agreed. Errors: device.
  Result<bool> FormatUnchanged();

 private:
  friend class MappedFrame;
  struct Mapping {
    void* address = nullptr;
    std::size_t length = 0;
  };
  V4l2Stream(std::shared_ptr<V4l2System> system, V4l2Device& device)
      : system_(std::move(system)), device_(device) {}
  Status SetFormat(const FormatWish& wish);
  Status SetInterval(std::int64_t wish_ns);
  Status MapBuffers(std::uint32_t count);
  Status Queue(std::uint32_t buffer);
  void GiveBack(std::uint32_t buffer);
  // A frame, nothing when the queue is empty, or the fault.
  Result<std::unique_ptr<MappedFrame>> Take(Clock& clock);

  std::shared_ptr<V4l2System> system_;
  V4l2Device& device_;
  StreamFormat format_;
  std::vector<Mapping> mappings_;
  bool requested_ = false, running_ = false;
  std::optional<Error> queue_fault_;  // of a buffer given back
  std::int64_t empty_ns_ = 0;
};

}  // namespace scan
