#include "drivers/camera/v4l2/v4l2_stream.h"

#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <optional>

namespace scan {
namespace {

constexpr std::int64_t kPollSliceNs = 50'000'000;  // how late a stop request may be heard
constexpr std::int64_t kInterruptedNs = 1'000'000;

v4l2_buffer EmptyBuffer(std::uint32_t index = 0) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

YcbcrMatrix MatrixOf(const v4l2_pix_format& pix) {
  std::uint32_t encoding = pix.ycbcr_enc;
  if (encoding == V4L2_YCBCR_ENC_DEFAULT) encoding = V4L2_MAP_YCBCR_ENC_DEFAULT(pix.colorspace);
  switch (encoding) {
    case V4L2_YCBCR_ENC_709:
    case V4L2_YCBCR_ENC_XV709:
      return YcbcrMatrix::bt709;
    case V4L2_YCBCR_ENC_BT2020:
    case V4L2_YCBCR_ENC_BT2020_CONST_LUM:  // nearest: constant luminance is not linear in RGB
      return YcbcrMatrix::bt2020;
    case V4L2_YCBCR_ENC_SMPTE240M:
      return YcbcrMatrix::smpte240m;
    default:
      return YcbcrMatrix::bt601;
  }
}

bool FullRangeOf(const v4l2_pix_format& pix) {
  if (pix.quantization != V4L2_QUANTIZATION_DEFAULT)
    return pix.quantization == V4L2_QUANTIZATION_FULL_RANGE;
  return pix.colorspace == V4L2_COLORSPACE_JPEG;  // the kernel's default for all other YCbCr
}

bool HoldsWholeFrames(std::uint32_t field) {
  return field == V4L2_FIELD_NONE || field == V4L2_FIELD_ANY || field == V4L2_FIELD_INTERLACED;
}

StampKind KindOf(std::uint32_t flags) {
  if ((flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC)
    return StampKind::none;
  return (flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE
             ? StampKind::start_of_frame
             : StampKind::end_of_frame;
}

}  // namespace

MappedFrame::MappedFrame(MappedFrame&& other) noexcept
    : buffer(other.buffer),
      sequence(other.sequence),
      stamp(other.stamp),
      stamp_ns(other.stamp_ns),
      flagged(other.flagged),
      arrived_after_ns(other.arrived_after_ns),
      taken_ns(other.taken_ns),
      stream_(std::exchange(other.stream_, nullptr)),
      bytes_(other.bytes_) {}

MappedFrame::~MappedFrame() {
  if (stream_) stream_->GiveBack(buffer);
}

Result<std::unique_ptr<V4l2Stream>> V4l2Stream::Start(std::shared_ptr<V4l2System> system,
                                                      V4l2Device& device, const FormatWish& wish,
                                                      std::uint32_t buffers) {
  std::unique_ptr<V4l2Stream> stream(new V4l2Stream(std::move(system), device));
  SCAN_CHECK(stream->SetFormat(wish));
  SCAN_CHECK(stream->SetInterval(wish.interval_ns));
  SCAN_CHECK(stream->MapBuffers(buffers));
  for (std::uint32_t i = 0; i < stream->buffer_count(); ++i) SCAN_CHECK(stream->Queue(i));
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  SCAN_CHECK(device.Call(VIDIOC_STREAMON, "VIDIOC_STREAMON", &type));
  stream->running_ = true;
  return stream;
}

V4l2Stream::~V4l2Stream() {
  // Each of these may fail on a camera that is gone; the kernel then frees all with the descriptor.
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (running_) device_.Try(VIDIOC_STREAMOFF, &type);
  for (const Mapping& mapping : mappings_) system_->Unmap(mapping.address, mapping.length);
  if (!requested_) return;
  v4l2_requestbuffers none{};
  none.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  none.memory = V4L2_MEMORY_MMAP;
  device_.Try(VIDIOC_REQBUFS, &none);
}

Status V4l2Stream::SetFormat(const FormatWish& wish) {
  SCAN_TRY(const auto offered, ListFormats(device_, false));
  SCAN_TRY(const FormatChoice choice, ChooseFormat(offered, wish, device_.Where()));
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  v4l2_pix_format& pix = format.fmt.pix;
  pix.width = static_cast<std::uint32_t>(choice.w);
  pix.height = static_cast<std::uint32_t>(choice.h);
  pix.pixelformat = choice.format->fourcc;
  pix.field = V4L2_FIELD_NONE;
  SCAN_CHECK(device_.Call(VIDIOC_S_FMT, "VIDIOC_S_FMT", &format));
  if (pix.pixelformat != choice.format->fourcc || static_cast<int>(pix.width) != choice.w ||
      static_cast<int>(pix.height) != choice.h || !HoldsWholeFrames(pix.field))
    return DeviceFault(
        fmt::format("asked for {} {}x{}, the camera made it {} {}x{}, field {}",
                    choice.format->name, choice.w, choice.h, FourccText(pix.pixelformat), pix.width,
                    pix.height, pix.field),
        device_.Where(),
        "choose another format or size; 'scanstation device camera list' shows them");
  format_.format = choice.format;
  format_.w = choice.w;
  format_.h = choice.h;
  format_.bytes_per_line =
      std::max(static_cast<int>(pix.bytesperline), MinBytesPerLine(*choice.format, choice.w));
  format_.size_image = pix.sizeimage;
  format_.matrix = MatrixOf(pix);
  format_.full_range = FullRangeOf(pix);
  return {};
}

Status V4l2Stream::SetInterval(std::int64_t wish_ns) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (wish_ns > 0) {
    parameters.parm.capture.timeperframe = {static_cast<std::uint32_t>(wish_ns / 100), 10'000'000U};
    SCAN_CHECK(device_.Call(VIDIOC_S_PARM, "VIDIOC_S_PARM", &parameters));
  } else if (const int result = device_.Try(VIDIOC_G_PARM, &parameters); result < 0) {
    if (result == -ENOTTY || result == -EINVAL) return {};  // the interval stays unknown
    return tl::unexpected(V4l2Error(-result, "VIDIOC_G_PARM", device_.Where()));
  }
  const v4l2_fract& seconds = parameters.parm.capture.timeperframe;
  if (seconds.denominator > 0)
    format_.interval_ns = std::int64_t{seconds.numerator} * 1'000'000'000 / seconds.denominator;
  return {};
}

Status V4l2Stream::MapBuffers(std::uint32_t count) {
  v4l2_requestbuffers request{};
  request.count = count;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  SCAN_CHECK(device_.Call(VIDIOC_REQBUFS, "VIDIOC_REQBUFS", &request));
  requested_ = true;
  if (request.count < 2)
    return DeviceFault(fmt::format("the driver gave {} buffers", request.count), device_.Where(),
                       "close other programs: the kernel is short of memory");
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = EmptyBuffer(i);
    SCAN_CHECK(device_.Call(VIDIOC_QUERYBUF, "VIDIOC_QUERYBUF", &buffer));
    Mapping mapping;
    mapping.length = buffer.length;
    const int mapped = system_->Map(device_.fd(), buffer.length, buffer.m.offset, mapping.address);
    if (mapped < 0) return tl::unexpected(V4l2Error(-mapped, "mapping a buffer", device_.Where()));
    mappings_.push_back(mapping);
  }
  return {};
}

Status V4l2Stream::Queue(std::uint32_t index) {
  v4l2_buffer buffer = EmptyBuffer(index);
  return device_.Call(VIDIOC_QBUF, "VIDIOC_QBUF", &buffer);
}

void V4l2Stream::GiveBack(std::uint32_t buffer) {
  if (const Status queued = Queue(buffer); !queued && !queue_fault_) queue_fault_ = queued.error();
}

Result<std::unique_ptr<MappedFrame>> V4l2Stream::Take(Clock& clock) {
  const std::int64_t before_ns = clock.Now().mono_ns;
  v4l2_buffer buffer = EmptyBuffer();
  const int result = device_.Try(VIDIOC_DQBUF, &buffer);
  if (result == -EAGAIN) {
    empty_ns_ = before_ns;
    return std::unique_ptr<MappedFrame>();
  }
  if (result < 0) return tl::unexpected(V4l2Error(-result, "VIDIOC_DQBUF", device_.Where()));
  if (buffer.index >= mappings_.size() || buffer.bytesused > mappings_[buffer.index].length)
    return DeviceFault(fmt::format("the driver gave buffer {} with {} bytes, which it cannot have",
                                   buffer.index, buffer.bytesused),
                       device_.Where(), "replug the camera");
  const Mapping& mapping = mappings_[buffer.index];
  std::unique_ptr<MappedFrame> frame(new MappedFrame(
      this, {static_cast<const std::byte*>(mapping.address), std::size_t{buffer.bytesused}}));
  frame->buffer = buffer.index;
  frame->sequence = buffer.sequence;
  frame->stamp = KindOf(buffer.flags);
  frame->stamp_ns = std::int64_t{buffer.timestamp.tv_sec} * 1'000'000'000 +
                    std::int64_t{buffer.timestamp.tv_usec} * 1000;
  frame->flagged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
  frame->arrived_after_ns = empty_ns_;
  frame->taken_ns = clock.Now().mono_ns;
  return frame;
}

Result<MappedFrame> V4l2Stream::Next(Clock& clock, std::int64_t deadline_ns, std::stop_token stop) {
  for (;;) {
    if (stop.stop_requested()) return Cancelled(device_.Where());
    if (queue_fault_) return tl::unexpected(*queue_fault_);
    SCAN_TRY(const auto frame, Take(clock));
    if (frame) return std::move(*frame);
    const std::int64_t left_ns = deadline_ns - clock.Now().mono_ns;
    if (left_ns <= 0)
      return DeviceFault("the camera sends no more frames", device_.Where(),
                         "check cable and hub; a smaller size or MJPG needs less of the USB bus");
    const std::int64_t slice_ms = (std::min(left_ns, kPollSliceNs) + 999'999) / 1'000'000;
    const int events = system_->Poll(device_.fd(), POLLIN, static_cast<int>(slice_ms));
    if (events == -EINTR || events == -EAGAIN) {
      clock.SleepFor(kInterruptedNs, stop);  // never a busy loop, whatever interrupts us
      continue;
    }
    if (events < 0) return tl::unexpected(V4l2Error(-events, "poll", device_.Where()));
    if (events > 0 && !(events & POLLIN)) {  // POLLERR or POLLHUP: the queue says why, or nobody
      SCAN_TRY(const auto last, Take(clock));
      if (last) return std::move(*last);
      return DeviceFault("the driver ended the stream", device_.Where(),
                         "check that the camera is still plugged in");
    }
  }
}

Result<DmaBuffer> V4l2Stream::ExportDmaBuffer(std::uint32_t buffer) {
  v4l2_exportbuffer request{};
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.index = buffer;
  SCAN_CHECK(device_.Call(VIDIOC_EXPBUF, "VIDIOC_EXPBUF", &request));
  return DmaBuffer(system_, request.fd);
}

std::span<const std::byte> V4l2Stream::Memory(std::uint32_t buffer) const {
  const Mapping& mapping = mappings_[buffer];
  return {static_cast<const std::byte*>(mapping.address), mapping.length};
}

Result<bool> V4l2Stream::FormatUnchanged() {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  SCAN_CHECK(device_.Call(VIDIOC_G_FMT, "VIDIOC_G_FMT", &format));
  const v4l2_pix_format& pix = format.fmt.pix;
  return pix.pixelformat == format_.format->fourcc && static_cast<int>(pix.width) == format_.w &&
         static_cast<int>(pix.height) == format_.h;
}

}  // namespace scan
