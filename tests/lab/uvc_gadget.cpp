#include "tests/lab/uvc_gadget.h"

#include <fcntl.h>
#include <linux/usb/ch9.h>
#include <linux/usb/g_uvc.h>
#include <linux/usb/video.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <vector>

#include "drivers/base/unique_fd.h"

namespace scan {

// USB Video Class 1.1, table 4-75: the streaming interface's probe and commit controls.
struct [[gnu::packed]] UvcStreamingControl {
  std::uint16_t bmHint;
  std::uint8_t bFormatIndex, bFrameIndex;
  std::uint32_t dwFrameInterval;
  std::uint16_t wKeyFrameRate, wPFrameRate, wCompQuality, wCompWindowSize, wDelay;
  std::uint32_t dwMaxVideoFrameSize, dwMaxPayloadTransferSize, dwClockFrequency;
  std::uint8_t bmFramingInfo, bPreferedVersion, bMinVersion, bMaxVersion;
};

// One control of the camera terminal (entity 1) or the processing unit (entity 2).
struct UvcUnitControl {
  std::uint16_t size = 2;
  std::int32_t min = 0, max = 0, step = 1, standard = 0, now = 0;
};

namespace {

constexpr std::int64_t kTickMs = 5;
constexpr std::pair<int, int> kSizes[] = {{640, 480}, {1280, 720}, {1920, 1080}};  // as in uvc.sh
constexpr std::uint8_t kYuyv = 1, kMjpeg = 2;

std::int64_t NowNs() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

using UnitKey = std::pair<int, int>;  // entity, selector
constexpr UnitKey kExposureMode{1, 2}, kExposureTime{1, 4};

// The gadget's own node carries the name of its USB device controller.
std::string GadgetNode() {
  for (const auto& entry : std::filesystem::directory_iterator("/sys/class/video4linux")) {
    std::ifstream in(entry.path() / "function_name");
    std::string name;
    if (std::getline(in, name)) return "/dev/" + entry.path().filename().string();
  }
  return {};
}

}  // namespace

class UvcGadget::Feeder {
 public:
  Feeder(UniqueFd fd, GadgetPainter painter)
      : own_(std::move(fd)), fd_(own_.get()), painter_(std::move(painter)) {
    units_[kExposureMode] = {1, 1, 8, 0x09, 8, 8};  // step: the modes that are there (bits)
    units_[kExposureTime] = {4, 1, 5000, 1, 80, 80};
    units_[{2, 2}] = {2, -64, 64, 1, 0, 0};   // brightness
    units_[{2, 4}] = {2, 0, 255, 1, 16, 16};  // gain
    probe_ = commit_ = Standard(kYuyv, 1, 1'000'000);
  }

  bool Subscribe() {
    for (std::uint32_t type = UVC_EVENT_FIRST; type <= UVC_EVENT_LAST; ++type) {
      v4l2_event_subscription subscription{};
      subscription.type = type;
      if (ioctl(fd_, VIDIOC_SUBSCRIBE_EVENT, &subscription) < 0) return false;
    }
    return true;
  }

  [[noreturn]] void Run() {
    for (;;) {
      // The kernel calls an output queue writable while any buffer is free: time is the only
      // wake-up.
      const std::int64_t left_ms = (next_ns_ - NowNs()) / 1'000'000;
      const int wait_ms =
          streaming_ ? static_cast<int>(std::clamp<std::int64_t>(left_ms, kTickMs, 1000)) : -1;
      pollfd waiting{fd_, POLLPRI, 0};
      poll(&waiting, 1, wait_ms);
      if (waiting.revents & POLLPRI) TakeEvent();
      if (streaming_) Feed();
    }
  }

 private:
  struct Buffer {
    void* memory = nullptr;
    std::size_t size = 0;
  };

  static UvcStreamingControl Standard(int format, int frame, std::uint32_t interval) {
    UvcStreamingControl c{};
    c.bmHint = 1;
    c.bFormatIndex = static_cast<std::uint8_t>(std::clamp(format, 1, 2));
    c.bFrameIndex = static_cast<std::uint8_t>(std::clamp(frame, 1, 3));
    c.dwFrameInterval = interval < 333'333 ? 1'000'000 : interval;
    const auto [w, h] = kSizes[c.bFrameIndex - 1];
    c.dwMaxVideoFrameSize = static_cast<std::uint32_t>(w * h * 2);
    c.dwMaxPayloadTransferSize = 3072;
    c.dwClockFrequency = 48'000'000;
    c.bmFramingInfo = 3;
    c.bPreferedVersion = c.bMinVersion = c.bMaxVersion = 1;
    return c;
  }

  void TakeEvent() {
    v4l2_event event{};
    if (ioctl(fd_, VIDIOC_DQEVENT, &event) < 0) return;
    uvc_event uvc{};
    std::memcpy(&uvc, &event.u.data, std::min(sizeof(uvc), sizeof(event.u.data)));
    switch (event.type) {
      case UVC_EVENT_SETUP:
        Answer(uvc.req);
        break;
      case UVC_EVENT_DATA:
        TakeData(uvc.data);
        break;
      case UVC_EVENT_STREAMON:
        Start();
        break;
      case UVC_EVENT_STREAMOFF:
      case UVC_EVENT_DISCONNECT:
        Stop();
        break;
      default:
        break;
    }
  }

  void Answer(const usb_ctrlrequest& request) {
    if ((request.bRequestType & USB_TYPE_MASK) != USB_TYPE_CLASS) return;
    uvc_request_data answer{};
    answer.length = -EL2HLT;  // a stall: not known here
    const int entity = request.wIndex >> 8, interface = request.wIndex & 0xff;
    pending_ = {interface, entity, request.wValue >> 8};
    if (interface == 1 && entity == 0)
      AnswerStreaming(request, answer);
    else if (const auto unit = units_.find({entity, pending_.selector}); unit != units_.end())
      AnswerUnit(request, unit->second, answer);
    ioctl(fd_, UVCIOC_SEND_RESPONSE, &answer);
  }

  void AnswerStreaming(const usb_ctrlrequest& request, uvc_request_data& answer) {
    UvcStreamingControl control = pending_.selector == UVC_VS_COMMIT_CONTROL ? commit_ : probe_;
    if (request.bRequest == UVC_GET_MIN || request.bRequest == UVC_GET_DEF)
      control = Standard(kYuyv, 1, 0);
    if (request.bRequest == UVC_GET_MAX) control = Standard(kMjpeg, 3, 0);
    if (request.bRequest == UVC_GET_INFO || request.bRequest == UVC_GET_LEN) {
      answer.data[0] = request.bRequest == UVC_GET_INFO ? 3 : sizeof(control);
      answer.length = request.bRequest == UVC_GET_INFO ? 1 : 2;
      return;
    }
    answer.length = std::min<int>(request.wLength, sizeof(control));
    if (request.bRequest != UVC_SET_CUR)
      std::memcpy(answer.data, &control, static_cast<std::size_t>(answer.length));
  }

  void AnswerUnit(const usb_ctrlrequest& request, const UvcUnitControl& unit,
                  uvc_request_data& answer) {
    answer.length = std::min<int>(request.wLength, unit.size);
    const auto put = [&](std::int32_t value) { std::memcpy(answer.data, &value, 4); };
    switch (request.bRequest) {
      case UVC_SET_CUR:
        break;
      case UVC_GET_CUR:
        put(unit.now);
        break;
      case UVC_GET_MIN:
        put(unit.min);
        break;
      case UVC_GET_MAX:
        put(unit.max);
        break;
      case UVC_GET_RES:
        put(unit.step);
        break;
      case UVC_GET_DEF:
        put(unit.standard);
        break;
      case UVC_GET_INFO:
        put(3);
        answer.length = 1;
        break;
      case UVC_GET_LEN:
        put(unit.size);
        answer.length = 2;
        break;
      default:
        answer.length = -EL2HLT;
    }
  }

  void TakeData(const uvc_request_data& data) {
    if (pending_.interface == 1 && pending_.entity == 0) {
      UvcStreamingControl asked{};
      std::memcpy(&asked, data.data, std::min<std::size_t>(sizeof(asked), sizeof(data.data)));
      UvcStreamingControl& control = pending_.selector == UVC_VS_COMMIT_CONTROL ? commit_ : probe_;
      control = Standard(asked.bFormatIndex, asked.bFrameIndex, asked.dwFrameInterval);
      return;
    }
    const auto found = units_.find({pending_.entity, pending_.selector});
    if (found == units_.end()) return;
    std::int32_t value = 0;
    std::memcpy(&value, data.data, found->second.size);
    if (found->second.size == 2) value = static_cast<std::int16_t>(value);
    found->second.now = std::clamp(value, found->second.min, found->second.max);
  }

  void Start() {
    const auto [w, h] = kSizes[commit_.bFrameIndex - 1];
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    format.fmt.pix.width = static_cast<std::uint32_t>(w);
    format.fmt.pix.height = static_cast<std::uint32_t>(h);
    format.fmt.pix.pixelformat =
        commit_.bFormatIndex == kMjpeg ? V4L2_PIX_FMT_MJPEG : V4L2_PIX_FMT_YUYV;
    format.fmt.pix.sizeimage = static_cast<std::uint32_t>(w * h * 2);
    ioctl(fd_, VIDIOC_S_FMT, &format);
    v4l2_requestbuffers request{};
    request.count = 4;
    request.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    request.memory = V4L2_MEMORY_MMAP;
    if (ioctl(fd_, VIDIOC_REQBUFS, &request) < 0) return;
    for (std::uint32_t i = 0; i < request.count; ++i) {
      v4l2_buffer buffer = OutputBuffer(i);
      ioctl(fd_, VIDIOC_QUERYBUF, &buffer);
      buffers_.push_back(
          {mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, buffer.m.offset),
           buffer.length});
      idle_.push_back(request.count - 1 - i);
    }
    next_ns_ = NowNs();
    streaming_ = true;
    Feed();  // the gadget's stream must not start empty
    int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    ioctl(fd_, VIDIOC_STREAMON, &type);
  }

  void Stop() {
    if (!streaming_) return;
    int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    ioctl(fd_, VIDIOC_STREAMOFF, &type);
    for (const Buffer& buffer : buffers_) munmap(buffer.memory, buffer.size);
    v4l2_requestbuffers none{};
    none.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    none.memory = V4L2_MEMORY_MMAP;
    ioctl(fd_, VIDIOC_REQBUFS, &none);
    buffers_.clear();
    idle_.clear();
    streaming_ = false;
  }

  static v4l2_buffer OutputBuffer(std::uint32_t index) {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = index;
    return buffer;
  }

  void Feed() {
    for (v4l2_buffer done = OutputBuffer(0); ioctl(fd_, VIDIOC_DQBUF, &done) == 0;
         done = OutputBuffer(0))
      idle_.push_back(done.index);
    // One on its way and one behind it: a camera shows what is, not what was four pictures ago.
    const std::size_t queued = buffers_.size() - idle_.size();
    if (idle_.empty() || queued >= 2 || NowNs() < next_ns_) return;
    v4l2_buffer buffer = OutputBuffer(idle_.back());
    const std::size_t used = Paint(buffers_[buffer.index]);
    if (used == 0) return;
    idle_.pop_back();
    buffer.bytesused = static_cast<std::uint32_t>(used);
    ioctl(fd_, VIDIOC_QBUF, &buffer);
    ++number_;
    const std::int64_t interval_ns = std::int64_t{commit_.dwFrameInterval} * 100;
    next_ns_ = std::max(next_ns_ + interval_ns, NowNs());  // late: no burst
  }

  std::size_t Paint(const Buffer& buffer) {
    const auto [w, h] = kSizes[commit_.bFrameIndex - 1];
    return painter_({w, h, commit_.bFormatIndex == kMjpeg, number_, units_.at(kExposureTime).now},
                    {static_cast<std::uint8_t*>(buffer.memory), buffer.size});
  }

  struct Pending {
    int interface = 0, entity = 0, selector = 0;
  };
  UniqueFd own_;
  int fd_;
  GadgetPainter painter_;
  UvcStreamingControl probe_{}, commit_{};
  std::map<UnitKey, UvcUnitControl> units_;
  Pending pending_;
  std::vector<Buffer> buffers_;
  std::vector<std::uint32_t> idle_;
  bool streaming_ = false;
  std::uint32_t number_ = 0;
  std::int64_t next_ns_ = 0;
};

UvcGadget::UvcGadget(std::unique_ptr<Feeder> feeder) : feeder_(std::move(feeder)) {}
UvcGadget::~UvcGadget() = default;

Result<std::unique_ptr<UvcGadget>> UvcGadget::Open(GadgetPainter painter) {
  const std::string node = GadgetNode();
  UniqueFd fd(open(node.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!fd)
    return DeviceFault("no gadget: " + std::string(std::strerror(errno)), node,
                       "source guest/uvc.sh");
  auto feeder = std::make_unique<Feeder>(std::move(fd), std::move(painter));
  if (!feeder->Subscribe())
    return DeviceFault("no events: " + std::string(std::strerror(errno)), node, "see dmesg");
  return std::unique_ptr<UvcGadget>(new UvcGadget(std::move(feeder)));
}

void UvcGadget::Run() { feeder_->Run(); }

}  // namespace scan
