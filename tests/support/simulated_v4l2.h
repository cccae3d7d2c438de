// A camera behind the V4L2 seam, as a kernel driver would show it, with faults on request.
#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/base/clock.h"
#include "drivers/camera/v4l2/v4l2_system.h"

namespace scan {

enum class FrameFault {
  none,
  short_frame,
  long_frame,
  empty,
  flagged,
  stale_sequence,
  stale_stamp,
  future_stamp,
  cut_jpeg,
  spoiled_jpeg
};

struct SimulatedControl {
  std::uint32_t id = 0;
  std::string title;
  std::uint32_t type = V4L2_CTRL_TYPE_INTEGER;
  std::int64_t min = 0, max = 1, value = 0;
  std::int64_t made_multiple_of = 1;  // the device rounds down to it
  std::uint32_t flags = 0;
  std::map<std::int64_t, std::string> menu;
  std::optional<std::pair<std::uint32_t, std::int64_t>> writable_while;  // other control's value
};

struct SimulatedFormat {
  std::uint32_t fourcc = V4L2_PIX_FMT_YUYV;
  std::vector<std::pair<int, int>> sizes;  // the first: largest where stepwise
  bool stepwise = false;
};

struct SimulatedV4l2Options {
  std::string name = "Sim Cam", port = "sim-hcd.0/1.2";
  std::vector<SimulatedFormat> formats = {{V4L2_PIX_FMT_YUYV, {{64, 48}, {32, 24}}},
                                          {V4L2_PIX_FMT_MJPEG, {{64, 48}, {128, 96}}}};
  std::vector<SimulatedControl> controls;  // empty: those of a webcam
  std::int64_t interval_ns = 33'000'000;
  int held_frames = 1;     // frame intervals between the exposure and the first bytes
  int settings_delay = 2;  // frames until a new exposure applies
  std::uint32_t stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  std::int64_t stamp_ahead_ns = 0;
  std::uint32_t colorspace = V4L2_COLORSPACE_SRGB, ycbcr_enc = 0, quantization = 0;
  int line_padding = 0;  // bytes
  bool huffman_tables = true;
};

// Time is the clock's: Poll sleeps on it. Thread contract: one thread at a time.
class SimulatedV4l2 final : public V4l2System {
 public:
  SimulatedV4l2(SimulatedV4l2Options options, std::shared_ptr<Clock> clock);
  ~SimulatedV4l2() override;

  std::vector<VideoNode> ListNodes() override;
  int Open(const std::string& path) override;
  int Ioctl(int fd, unsigned long request, void* argument) override;
  int Map(int fd, std::size_t length, std::int64_t offset, void*& address) override;
  void Unmap(void* address, std::size_t length) override;
  int Poll(int fd, short events, int timeout_ms) override;
  void Close(int fd) override;

  // Faults. Calls (open, ioctl, map, poll) count from 1.
  int calls = 0;
  int fail_at = 0, fail_count = 1, fail_errno = 0;
  std::map<std::uint32_t, FrameFault> frame_faults;  // by the driver's sequence
  FrameFault every_frame = FrameFault::none;
  std::optional<std::int64_t> silent_from_ns, silent_until_ns;
  void UnplugAt(std::int64_t when_ns, std::int64_t back_ns);
  void ChangeFormat(int w, int h);  // as another program would
  SimulatedControl& control(std::uint32_t id);

  // What is still held by the user of the seam.
  int open_descriptors() const { return static_cast<int>(descriptors_.size()); }
  int live_mappings() const { return static_cast<int>(mappings_.size()); }
  int live_buffers() const { return static_cast<int>(buffers_.size()); }

  struct Truth {
    std::int64_t exposure_start_ns = 0;
    double exposure_us = 0;
  };
  const Truth& truth(std::uint64_t sequence) const { return truth_.at(sequence); }

 private:
  struct Buffer {
    std::shared_ptr<std::vector<std::byte>> memory;
    bool queued = false;
    v4l2_buffer done{};
  };
  struct Flying {
    std::uint32_t sequence = 0;
    std::int64_t first_bytes_ns = 0, complete_ns = 0;
  };
  bool FailsNow();
  bool Gone();
  void Advance();
  void Deliver(const Flying& frame);
  std::vector<std::byte> PictureOf(std::uint32_t sequence) const;
  const SimulatedFormat* FormatOf(std::uint32_t fourcc) const;
  void SetPix(v4l2_pix_format& pix);
  int SetFormat(v4l2_format& format);
  int ListSizes(v4l2_frmsizeenum& entry) const;
  int QueryControl(v4l2_query_ext_ctrl& query);
  int QueryMenu(v4l2_querymenu& query);
  int AccessControl(v4l2_ext_controls& controls, bool set);
  int RequestBuffers(v4l2_requestbuffers& request);
  int Dequeue(v4l2_buffer& buffer);
  int Dispatch(unsigned long request, void* argument);
  int StreamOn(bool on);

  SimulatedV4l2Options options_;
  std::shared_ptr<Clock> clock_;
  int next_descriptor_ = 1000, plugged_times_ = 0;
  std::map<int, int> descriptors_;  // to the plugging in which it was opened
  std::vector<std::pair<std::int64_t, std::int64_t>> unplugs_;
  std::uint32_t fourcc_ = 0;
  int w_ = 0, h_ = 0;
  std::vector<std::unique_ptr<Buffer>> buffers_;
  std::map<void*, std::shared_ptr<std::vector<std::byte>>> mappings_;
  std::deque<std::uint32_t> queue_, done_;
  bool streaming_ = false;
  std::uint32_t sequence_ = 0;
  std::int64_t next_start_ns_ = 0;
  std::deque<double> exposures_us_;  // of the last frames
  std::deque<Flying> flying_;
  std::map<std::uint64_t, Truth> truth_;
};

}  // namespace scan
