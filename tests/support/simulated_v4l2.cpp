#include "tests/support/simulated_v4l2.h"

#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <opencv2/core.hpp>
#include <tuple>

#include "drivers/camera/encode_picture.h"
#include "drivers/camera/v4l2/pixel_format.h"

namespace scan {
namespace {

constexpr std::size_t kMaxRememberedExposures = 32;

std::vector<SimulatedControl> WebcamControls() {
  const std::pair<std::uint32_t, std::int64_t> manual{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL};
  const std::pair<std::uint32_t, std::int64_t> no_awb{V4L2_CID_AUTO_WHITE_BALANCE, 0};
  const std::pair<std::uint32_t, std::int64_t> no_af{V4L2_CID_FOCUS_AUTO, 0};
  return {
      {V4L2_CID_BRIGHTNESS, "Brightness", V4L2_CTRL_TYPE_INTEGER, -64, 64, 0, 1, 0, {}, {}},
      {V4L2_CID_CONTRAST, "Contrast", V4L2_CTRL_TYPE_INTEGER, 0, 100, 50, 10, 0, {}, {}},
      {V4L2_CID_AUTO_WHITE_BALANCE,
       "White Balance, Automatic",
       V4L2_CTRL_TYPE_BOOLEAN,
       0,
       1,
       1,
       1,
       0,
       {},
       {}},
      {V4L2_CID_GAIN, "Gain", V4L2_CTRL_TYPE_INTEGER, 0, 256, 16, 1, 0, {}, {}},
      {V4L2_CID_POWER_LINE_FREQUENCY,
       "Power Line Frequency",
       V4L2_CTRL_TYPE_MENU,
       0,
       2,
       1,
       1,
       0,
       {{0, "Disabled"}, {1, "50 Hz"}, {2, "60 Hz"}},
       {}},
      {V4L2_CID_WHITE_BALANCE_TEMPERATURE,
       "White Balance Temperature",
       V4L2_CTRL_TYPE_INTEGER,
       2800,
       6500,
       4600,
       1,
       0,
       {},
       no_awb},
      {V4L2_CID_EXPOSURE_AUTO,
       "Auto Exposure",
       V4L2_CTRL_TYPE_MENU,
       0,
       3,
       3,
       1,
       0,
       {{1, "Manual Mode"}, {3, "Aperture Priority Mode"}},
       {}},
      {V4L2_CID_EXPOSURE_ABSOLUTE,
       "Exposure Time, Absolute",
       V4L2_CTRL_TYPE_INTEGER,
       3,
       2047,
       80,
       1,
       0,
       {},
       manual},
      {V4L2_CID_FOCUS_ABSOLUTE,
       "Focus, Absolute",
       V4L2_CTRL_TYPE_INTEGER,
       0,
       250,
       30,
       5,
       0,
       {},
       no_af},
      {V4L2_CID_FOCUS_AUTO,
       "Focus, Automatic Continuous",
       V4L2_CTRL_TYPE_BOOLEAN,
       0,
       1,
       1,
       1,
       0,
       {},
       {}},
      {V4L2_CID_ISO_SENSITIVITY,
       "ISO Sensitivity",
       V4L2_CTRL_TYPE_INTEGER_MENU,
       0,
       2,
       0,
       1,
       0,
       {{0, "100"}, {1, "200"}, {2, "400"}},
       {}},
  };
}

}  // namespace

SimulatedV4l2::SimulatedV4l2(SimulatedV4l2Options options, std::shared_ptr<Clock> clock)
    : options_(std::move(options)), clock_(std::move(clock)) {
  if (options_.controls.empty()) options_.controls = WebcamControls();
  // Controls are enumerated by rising id.
  std::sort(options_.controls.begin(), options_.controls.end(),
            [](const auto& a, const auto& b) { return a.id < b.id; });
  fourcc_ = options_.formats.front().fourcc;
  std::tie(w_, h_) = options_.formats.front().sizes.front();
}

SimulatedV4l2::~SimulatedV4l2() = default;

bool SimulatedV4l2::FailsNow() {
  ++calls;
  return fail_at > 0 && calls >= fail_at && calls < fail_at + fail_count;
}

void SimulatedV4l2::UnplugAt(std::int64_t when_ns, std::int64_t back_ns) {
  unplugs_.emplace_back(when_ns, back_ns);
}

bool SimulatedV4l2::Gone() {
  const std::int64_t now_ns = clock_->Now().mono_ns;
  bool gone = false;
  int times = 0;
  for (const auto& [from_ns, until_ns] : unplugs_) {
    if (now_ns < from_ns) continue;
    ++times;
    gone |= now_ns < until_ns;
  }
  plugged_times_ = times;
  return gone;
}

SimulatedControl& SimulatedV4l2::control(std::uint32_t id) {
  return *std::find_if(options_.controls.begin(), options_.controls.end(),
                       [&](const SimulatedControl& c) { return c.id == id; });
}

std::vector<VideoNode> SimulatedV4l2::ListNodes() {
  if (Gone()) return {};
  // At every plugging another number.
  return {{"/dev/video" + std::to_string(2 * plugged_times_), options_.name, options_.port,
           "1234:5678", "S1"}};
}

int SimulatedV4l2::Open(const std::string& path) {
  if (FailsNow()) return -fail_errno;
  const auto nodes = ListNodes();
  if (nodes.empty() || nodes.front().path != path) return -ENOENT;
  descriptors_[next_descriptor_] = plugged_times_;
  return next_descriptor_++;
}

void SimulatedV4l2::Close(int fd) {
  descriptors_.erase(fd);
  if (!descriptors_.empty()) return;
  buffers_.clear();
  StreamOn(false);
}

int SimulatedV4l2::Ioctl(int fd, unsigned long request, void* argument) {
  if (FailsNow()) return -fail_errno;
  const auto descriptor = descriptors_.find(fd);
  if (descriptor == descriptors_.end()) return -EBADF;
  if (Gone() || descriptor->second != plugged_times_) return -ENODEV;
  Advance();
  return Dispatch(request, argument);
}

int SimulatedV4l2::Map(int fd, std::size_t length, std::int64_t offset, void*& address) {
  if (FailsNow()) return -fail_errno;
  const auto index = static_cast<std::size_t>(offset / 4096);
  if (!descriptors_.contains(fd) || index >= buffers_.size()) return -EINVAL;
  const auto& memory = buffers_[index]->memory;
  if (length != memory->size()) return -EINVAL;
  address = memory->data();
  mappings_[address] = memory;
  return 0;
}

void SimulatedV4l2::Unmap(void* address, std::size_t) { mappings_.erase(address); }

int SimulatedV4l2::Poll(int fd, short, int timeout_ms) {
  if (FailsNow()) return -fail_errno;
  const std::int64_t until_ns = clock_->Now().mono_ns + std::int64_t{timeout_ms} * 1'000'000;
  for (;;) {
    const auto descriptor = descriptors_.find(fd);
    if (Gone() || descriptor == descriptors_.end() || descriptor->second != plugged_times_)
      return POLLERR | POLLHUP;
    if (!streaming_) return POLLERR;
    Advance();
    if (!done_.empty()) return POLLIN;
    const std::int64_t now_ns = clock_->Now().mono_ns;
    if (now_ns >= until_ns) return 0;
    std::int64_t next_ns = until_ns;
    for (const auto& [from_ns, back_ns] : unplugs_)
      if (from_ns > now_ns) next_ns = std::min(next_ns, from_ns);
    const std::int64_t event_ns = flying_.empty() ? next_start_ns_ : flying_.front().complete_ns;
    if (event_ns > now_ns) next_ns = std::min(next_ns, event_ns);
    clock_->SleepUntil(next_ns);
  }
}

int SimulatedV4l2::StreamOn(bool on) {
  if (on && buffers_.empty()) return -EINVAL;
  streaming_ = on;
  sequence_ = 0;
  next_start_ns_ = clock_->Now().mono_ns;
  flying_.clear();
  queue_.clear();
  done_.clear();
  if (!on) {
    for (const auto& buffer : buffers_) buffer->queued = false;
  } else {
    for (std::uint32_t i = 0; i < buffers_.size(); ++i)
      if (buffers_[i]->queued) queue_.push_back(i);
  }
  return 0;
}

void SimulatedV4l2::Advance() {
  if (!streaming_) return;
  const std::int64_t now_ns = clock_->Now().mono_ns;
  while (next_start_ns_ <= now_ns) {
    exposures_us_.push_front(100.0 *
                             static_cast<double>(control(V4L2_CID_EXPOSURE_ABSOLUTE).value));
    if (exposures_us_.size() > kMaxRememberedExposures) exposures_us_.pop_back();
    const auto back =
        std::min(static_cast<std::size_t>(options_.settings_delay), exposures_us_.size() - 1);
    const double exposure_us = exposures_us_[back];
    const std::int64_t exposure_ns = std::llround(exposure_us * 1000);
    Flying frame{sequence_++, 0, 0};
    truth_[frame.sequence] = {next_start_ns_, exposure_us};
    frame.first_bytes_ns =
        next_start_ns_ + exposure_ns + options_.held_frames * options_.interval_ns;
    frame.complete_ns = frame.first_bytes_ns + options_.interval_ns * 4 / 5;
    const bool silent = silent_from_ns && next_start_ns_ >= *silent_from_ns &&
                        (!silent_until_ns || next_start_ns_ < *silent_until_ns);
    if (!silent) flying_.push_back(frame);
    next_start_ns_ += std::max(options_.interval_ns, exposure_ns);
  }
  while (!flying_.empty() && flying_.front().complete_ns <= now_ns) {
    Deliver(flying_.front());
    flying_.pop_front();
  }
}

void SimulatedV4l2::Deliver(const Flying& frame) {
  if (queue_.empty()) return;  // nobody gave a buffer: lost
  const std::uint32_t index = queue_.front();
  queue_.pop_front();
  Buffer& buffer = *buffers_[index];
  buffer.queued = false;
  const auto scripted = frame_faults.find(frame.sequence);
  const FrameFault fault = scripted == frame_faults.end() ? every_frame : scripted->second;
  std::vector<std::byte> picture = PictureOf(frame.sequence);
  std::size_t size = picture.size();
  if (fault == FrameFault::short_frame || fault == FrameFault::cut_jpeg) size = size * 2 / 3;
  if (fault == FrameFault::long_frame) size += 16;
  if (fault == FrameFault::empty) size = 0;
  if (fault == FrameFault::spoiled_jpeg)
    std::fill(picture.begin() + static_cast<std::ptrdiff_t>(size * 3 / 4),
              picture.begin() + static_cast<std::ptrdiff_t>(size * 3 / 4) + 24, std::byte{0xff});
  picture.resize(std::max(size, picture.size()));
  std::copy(picture.begin(), picture.begin() + static_cast<std::ptrdiff_t>(size),
            buffer.memory->begin());
  v4l2_buffer& done = buffer.done;
  done = {};
  done.index = index;
  done.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  done.memory = V4L2_MEMORY_MMAP;
  done.length = static_cast<std::uint32_t>(buffer.memory->size());
  done.bytesused = static_cast<std::uint32_t>(size);
  done.flags = options_.stamp_flags;
  if (fault == FrameFault::flagged) done.flags |= V4L2_BUF_FLAG_ERROR;
  done.sequence = frame.sequence - (fault == FrameFault::stale_sequence ? 3 : 0);
  const bool at_start =
      (options_.stamp_flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  std::int64_t stamp_ns = at_start ? frame.first_bytes_ns : frame.complete_ns;
  stamp_ns += options_.stamp_ahead_ns;
  if (fault == FrameFault::stale_stamp) stamp_ns -= 10 * options_.interval_ns;
  if (fault == FrameFault::future_stamp) stamp_ns += 3'600'000'000'000;
  done.timestamp.tv_sec = stamp_ns / 1'000'000'000;
  done.timestamp.tv_usec = stamp_ns % 1'000'000'000 / 1000;
  done_.push_back(index);
}

std::vector<std::byte> SimulatedV4l2::PictureOf(std::uint32_t sequence) const {
  const PixelFormat& format = *FindPixelFormat(fourcc_);
  if (format.layout != PixelLayout::mjpeg) {
    const int line = MinBytesPerLine(format, w_) + options_.line_padding;
    std::vector<std::byte> bytes(PictureBytes(format, w_, h_, line));
    for (std::size_t i = 0; i < bytes.size(); ++i)
      bytes[i] = static_cast<std::byte>(i % 2 == 1 ? 128 : 40 + (sequence + i / 64) % 160);
    return bytes;
  }
  cv::Mat picture(h_, w_, CV_8UC3);
  for (int y = 0; y < h_; ++y)
    for (int x = 0; x < w_; ++x)
      picture.at<cv::Vec3b>(y, x) = {static_cast<std::uint8_t>(3 * x + 7 * y),
                                     static_cast<std::uint8_t>(sequence * 5),
                                     static_cast<std::uint8_t>(y * x)};
  std::vector<std::byte> bytes = EncodePicture(picture, "jpg", 90)->bytes;
  if (!options_.huffman_tables) {  // FF C4, two bytes of length
    for (std::size_t at = 2; at + 4 < bytes.size() && bytes[at + 1] != std::byte{0xda};) {
      const std::size_t length = 2 + (std::to_integer<std::size_t>(bytes[at + 2]) << 8) +
                                 std::to_integer<std::size_t>(bytes[at + 3]);
      const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(at);
      if (bytes[at + 1] == std::byte{0xc4})
        bytes.erase(from, from + static_cast<std::ptrdiff_t>(length));
      else
        at += length;
    }
  }
  bytes.resize(bytes.size() + 13, std::byte{0});  // padding, as cameras add
  return bytes;
}

}  // namespace scan
