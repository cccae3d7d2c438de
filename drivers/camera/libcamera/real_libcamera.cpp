#include "drivers/camera/libcamera/real_libcamera.h"

#include <fmt/format.h>
#include <libcamera/libcamera.h>
#include <linux/dma-buf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>

#include "drivers/camera/libcamera/libcamera_format.h"

namespace scan {
namespace {

namespace lc = libcamera;

std::int64_t MonotonicNs() {
  return std::chrono::steady_clock::now().time_since_epoch().count();  // CLOCK_MONOTONIC
}

tl::unexpected<Error> Fault(const char* what, int code, const std::string& id) {
  return DeviceFault(fmt::format("{} ({})", what, std::strerror(-code)), "libcamera, " + id,
                     "check its cable, and that no other program uses the camera");
}

lc::StreamRole RoleOf(LibcameraRole role) {
  switch (role) {
    case LibcameraRole::still:
      return lc::StreamRole::StillCapture;
    case LibcameraRole::viewfinder:
      return lc::StreamRole::Viewfinder;
    case LibcameraRole::raw:
      return lc::StreamRole::Raw;
  }
  return lc::StreamRole::StillCapture;
}

LibcameraEntry EntryOf(const lc::Camera& camera) {
  const auto model = camera.properties().get(lc::properties::Model);
  return {camera.id(), model ? std::string(*model) : camera.id()};
}

std::optional<double> NumberOf(const lc::ControlValue& value) {
  if (value.isNone() || value.isArray()) return {};
  switch (value.type()) {
    case lc::ControlTypeBool:
      return value.get<bool>() ? 1 : 0;
    case lc::ControlTypeInteger32:
      return value.get<std::int32_t>();
    case lc::ControlTypeInteger64:
      return static_cast<double>(value.get<std::int64_t>());
    case lc::ControlTypeFloat:
      return value.get<float>();
    default:
      return {};
  }
}

// A number as a value of the control's type; nothing where it does not fit.
lc::ControlValue ValueOf(const lc::ControlId& id, double number) {
  const double most = id.type() == lc::ControlTypeInteger64 ? 0x1p62 : 0x7fffffff;
  if (!(std::abs(number) <= most)) return {};
  if (id.type() != lc::ControlTypeFloat && number != std::trunc(number)) return {};
  switch (id.type()) {
    case lc::ControlTypeBool:
      return lc::ControlValue(number != 0);
    case lc::ControlTypeInteger32:
      return lc::ControlValue(static_cast<std::int32_t>(number));
    case lc::ControlTypeInteger64:
      return lc::ControlValue(static_cast<std::int64_t>(number));
    case lc::ControlTypeFloat:
      return lc::ControlValue(static_cast<float>(number));
    default:
      return {};
  }
}

std::optional<double> ParseNumber(const std::string& text) {
  if (text == "true") return 1;
  if (text == "false") return 0;
  double number = 0;
  const auto end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), end, number);
  if (parsed.ec != std::errc() || parsed.ptr != end) return {};
  return number;
}

void TakeColours(const lc::StreamConfiguration& stream, StreamFormat& format) {
  if (!stream.colorSpace) return;
  format.full_range = stream.colorSpace->range == lc::ColorSpace::Range::Full;
  if (stream.colorSpace->ycbcrEncoding == lc::ColorSpace::YcbcrEncoding::Rec709)
    format.matrix = YcbcrMatrix::bt709;
  if (stream.colorSpace->ycbcrEncoding == lc::ColorSpace::YcbcrEncoding::Rec2020)
    format.matrix = YcbcrMatrix::bt2020;
}

// The memory of one frame buffer, mapped for reading. Planes that follow each other in one file
// are read where they are; others are put together first.
class BufferMap {
 public:
  static Result<BufferMap> Map(const lc::FrameBuffer& buffer, const std::string& id) {
    BufferMap map;
    for (const lc::FrameBuffer::Plane& plane : buffer.planes()) {
      const std::size_t offset =
          plane.offset == lc::FrameBuffer::Plane::kInvalidOffset ? 0 : plane.offset;
      if (!map.parts_.empty() && map.parts_.back().fd == plane.fd.get() &&
          map.parts_.back().offset + map.parts_.back().length == offset) {
        map.parts_.back().length += plane.length;
        map.plane_part_.push_back(map.parts_.size() - 1);
        continue;
      }
      map.parts_.push_back({plane.fd.get(), offset, plane.length, nullptr});
      map.plane_part_.push_back(map.parts_.size() - 1);
    }
    for (Part& part : map.parts_) {
      void* memory = ::mmap(nullptr, part.offset + part.length, PROT_READ, MAP_SHARED, part.fd, 0);
      if (memory == MAP_FAILED) return Fault("cannot map a buffer", -errno, id);
      part.memory = static_cast<const std::byte*>(memory);
    }
    return map;
  }

  BufferMap(BufferMap&& other) noexcept
      : parts_(std::exchange(other.parts_, {})),
        plane_part_(std::move(other.plane_part_)),
        together_(std::move(other.together_)) {}
  BufferMap(const BufferMap&) = delete;
  BufferMap& operator=(const BufferMap&) = delete;
  BufferMap& operator=(BufferMap&&) = delete;
  ~BufferMap() {
    for (const Part& part : parts_)
      if (part.memory) ::munmap(const_cast<std::byte*>(part.memory), part.offset + part.length);
  }

  // Brackets reading, for memory that the processor caches.
  void Sync(bool begin) const {
    dma_buf_sync sync{};
    sync.flags = DMA_BUF_SYNC_READ | (begin ? DMA_BUF_SYNC_START : DMA_BUF_SYNC_END);
    for (const Part& part : parts_) ::ioctl(part.fd, DMA_BUF_IOCTL_SYNC, &sync);
  }

  std::span<const std::byte> Bytes(const std::vector<std::size_t>& used_of_plane) {
    std::vector<std::size_t> used(parts_.size(), 0);
    for (std::size_t i = 0; i < used_of_plane.size(); ++i)
      used[plane_part_[std::min(i, plane_part_.size() - 1)]] += used_of_plane[i];
    for (std::size_t i = 0; i < parts_.size(); ++i) used[i] = std::min(used[i], parts_[i].length);
    if (parts_.size() == 1) return {parts_[0].memory + parts_[0].offset, used[0]};
    together_.clear();
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const std::byte* begin = parts_[i].memory + parts_[i].offset;
      together_.insert(together_.end(), begin, begin + used[i]);
    }
    return together_;
  }

 private:
  BufferMap() = default;
  struct Part {
    int fd = -1;
    std::size_t offset = 0, length = 0;
    const std::byte* memory = nullptr;
  };
  std::vector<Part> parts_;
  std::vector<std::size_t> plane_part_;
  std::vector<std::byte> together_;
};

class RealDevice final : public LibcameraDevice {
 public:
  RealDevice(std::shared_ptr<lc::CameraManager> manager, std::shared_ptr<lc::Camera> camera)
      : manager_(std::move(manager)), camera_(std::move(camera)), entry_(EntryOf(*camera_)) {
    camera_->requestCompleted.connect(this, &RealDevice::OnCompleted);
    camera_->disconnected.connect(this, &RealDevice::OnDisconnected);
  }

  ~RealDevice() override {
    if (started_) camera_->stop();  // waits for the requests, which come back cancelled
    camera_->requestCompleted.disconnect(this);
    camera_->disconnected.disconnect(this);
    requests_.clear();
    maps_.clear();
    if (allocator_ && stream_) allocator_->free(stream_);
    allocator_.reset();
    config_.reset();
    camera_->release();
  }

  const LibcameraEntry& entry() const override { return entry_; }

  std::vector<LibcameraOffer> Offers(LibcameraRole role) override {
    const auto config = camera_->generateConfiguration({RoleOf(role)});
    std::vector<LibcameraOffer> offers;
    if (!config || config->empty()) return offers;
    const lc::StreamFormats& formats = config->at(0).formats();
    for (const lc::PixelFormat& format : formats.pixelformats()) {
      LibcameraOffer offer{format.toString(), {}};
      for (const lc::Size& size : formats.sizes(format))
        offer.sizes.emplace_back(static_cast<int>(size.width), static_cast<int>(size.height));
      offers.push_back(std::move(offer));
    }
    return offers;
  }

  Result<LibcameraStream> Configure(LibcameraRole role, const std::string& format, int w,
                                    int h) override {
    config_ = camera_->generateConfiguration({RoleOf(role)});
    if (!config_ || config_->empty())
      return BadInput("the camera has no such stream", entry_.id, "choose another role");
    lc::StreamConfiguration& wanted = config_->at(0);
    wanted.pixelFormat = lc::PixelFormat::fromString(format);
    wanted.size = lc::Size(static_cast<unsigned>(w), static_cast<unsigned>(h));
    wanted.bufferCount = std::max(wanted.bufferCount, kRequests);
    if (config_->validate() == lc::CameraConfiguration::Invalid)
      return BadInput("the camera refuses " + wanted.toString(), entry_.id, "choose another size");
    if (wanted.pixelFormat.toString() != format || wanted.size.width != static_cast<unsigned>(w) ||
        wanted.size.height != static_cast<unsigned>(h))
      return BadInput(
          fmt::format("the camera made {} of {} x {} {}", wanted.toString(), w, h, format),
          entry_.id, "choose a size and format that 'device libcamera list' shows");
    if (const int code = camera_->configure(config_.get()); code < 0)
      return Fault("the camera cannot be configured", code, entry_.id);
    stream_ = wanted.stream();
    SCAN_CHECK(MakeRequests());
    LibcameraStream stream;
    stream.format.format = FindLibcameraFormat(format);
    stream.format.w = w;
    stream.format.h = h;
    stream.format.bytes_per_line = static_cast<int>(wanted.stride);
    stream.format.size_image = wanted.frameSize;
    TakeColours(wanted, stream.format);
    stream.requests = static_cast<int>(requests_.size());
    return stream;
  }

  std::map<std::string, LibcameraRange> Controls() override {
    std::map<std::string, LibcameraRange> ranges;
    for (const auto& [id, info] : camera_->controls()) {
      const auto min = NumberOf(info.min()), max = NumberOf(info.max());
      if (min && max) ranges[id->name()] = {*min, *max};
    }
    return ranges;
  }

  Status Start(const std::map<std::string, std::string>& fixed) override {
    for (const auto& [name, text] : fixed) {
      const lc::ControlId* id = FindControl(name);
      if (!id) {
        std::string names;
        for (const auto& known : camera_->controls()) names += " " + known.first->name();
        return BadInput(fmt::format("the camera has no control '{}'", name), entry_.id,
                        "choose from:" + names);
      }
      const auto number = ParseNumber(text);
      const lc::ControlValue value = number ? ValueOf(*id, *number) : lc::ControlValue();
      if (value.isNone())
        return BadInput(fmt::format("'{}' is no value of {}", text, name), entry_.id,
                        "write a number, true or false");
      fixed_.emplace_back(id->id(), value);
    }
    if (const int code = camera_->start(); code < 0)
      return Fault("the camera cannot be started", code, entry_.id);
    started_ = true;
    return {};
  }

  Status Queue(int request, const RequestSettings& settings) override {
    SCAN_CHECK(CheckConnected());
    const auto index = static_cast<std::size_t>(request);
    if (being_read_[index]) maps_[index].Sync(false);
    being_read_[index] = false;
    lc::Request& queued = *requests_[index];
    queued.reuse(lc::Request::ReuseBuffers);
    lc::ControlList& controls = queued.controls();
    for (const auto& [id, value] : fixed_) controls.set(id, value);
    if (settings.lock_automatics && Has(lc::controls::AeEnable))
      controls.set(lc::controls::AeEnable, false);
    if (settings.exposure_us && Has(lc::controls::ExposureTime))
      controls.set(lc::controls::ExposureTime,
                   static_cast<std::int32_t>(std::lround(*settings.exposure_us)));
    if (settings.gain && Has(lc::controls::AnalogueGain))
      controls.set(lc::controls::AnalogueGain, static_cast<float>(*settings.gain));
    if (const int code = camera_->queueRequest(&queued); code < 0)
      return Fault("a request cannot be queued", code, entry_.id);
    return {};
  }

  Result<std::optional<LibcameraCompletion>> Next(std::int64_t deadline_ns,
                                                  std::stop_token stop) override {
    Done done;
    {
      std::unique_lock lock(mutex_);
      const auto deadline =
          std::chrono::steady_clock::time_point(std::chrono::nanoseconds(deadline_ns));
      arrived_.wait_until(lock, stop, deadline, [this] { return !done_.empty() || removed_; });
      if (removed_) return CheckConnectedLocked();
      if (stop.stop_requested()) return Cancelled("camera " + entry_.id);
      if (done_.empty()) return std::optional<LibcameraCompletion>();
      done = done_.front();
      done_.pop_front();
    }
    return std::optional<LibcameraCompletion>(Read(done));
  }

 private:
  static constexpr unsigned kRequests = 4;
  struct Done {
    std::size_t index = 0;
    std::int64_t completed_ns = 0;
  };

  // On libcamera's thread.
  void OnCompleted(lc::Request* request) {
    const std::lock_guard lock(mutex_);
    done_.push_back({static_cast<std::size_t>(request->cookie()), MonotonicNs()});
    arrived_.notify_all();
  }
  void OnDisconnected() {
    const std::lock_guard lock(mutex_);
    removed_ = true;
    arrived_.notify_all();
  }

  tl::unexpected<Error> CheckConnectedLocked() const {
    return DeviceFault("the camera was removed", "libcamera, " + entry_.id, "plug it in again");
  }
  Status CheckConnected() {
    const std::lock_guard lock(mutex_);
    if (removed_) return CheckConnectedLocked();
    return {};
  }

  bool Has(const lc::ControlId& id) const {
    return camera_->controls().find(id.id()) != camera_->controls().end();
  }
  const lc::ControlId* FindControl(const std::string& name) const {
    for (const auto& known : camera_->controls())
      if (known.first->name() == name) return known.first;
    return nullptr;
  }

  Status MakeRequests() {
    allocator_ = std::make_unique<lc::FrameBufferAllocator>(camera_);
    if (const int code = allocator_->allocate(stream_); code < 0)
      return Fault("there are no buffers", code, entry_.id);
    for (const std::unique_ptr<lc::FrameBuffer>& buffer : allocator_->buffers(stream_)) {
      std::unique_ptr<lc::Request> request = camera_->createRequest(requests_.size());
      if (!request) return Fault("there are no requests", -ENOMEM, entry_.id);
      if (const int code = request->addBuffer(stream_, buffer.get()); code < 0)
        return Fault("a buffer cannot be used", code, entry_.id);
      SCAN_TRY(BufferMap map, BufferMap::Map(*buffer, entry_.id));
      maps_.push_back(std::move(map));
      requests_.push_back(std::move(request));
    }
    being_read_.assign(requests_.size(), false);
    return {};
  }

  LibcameraCompletion Read(const Done& done) {
    lc::Request& request = *requests_[done.index];
    LibcameraCompletion completion;
    completion.request = static_cast<int>(done.index);
    completion.completed_ns = done.completed_ns;
    completion.cancelled = request.status() == lc::Request::RequestCancelled;
    const lc::FrameBuffer* buffer = request.findBuffer(stream_);
    const lc::FrameMetadata& frame = buffer->metadata();
    completion.damaged = frame.status == lc::FrameMetadata::FrameError ||
                         frame.status == lc::FrameMetadata::FrameCancelled;
    // Later releases have one more status: of a camera that has just been started.
    completion.startup = !completion.damaged && frame.status != lc::FrameMetadata::FrameSuccess;
    completion.sequence = frame.sequence;
    const lc::ControlList& metadata = request.metadata();
    if (const auto stamp = metadata.get(lc::controls::SensorTimestamp))
      completion.sensor_timestamp_ns = *stamp;
    if (const auto duration = metadata.get(lc::controls::FrameDuration))
      completion.frame_duration_ns = 1000 * *duration;
    if (const auto exposure = metadata.get(lc::controls::ExposureTime))
      completion.exposure_us = *exposure;
    if (const auto gain = metadata.get(lc::controls::AnalogueGain))
      completion.gain = static_cast<double>(*gain);
    if (completion.cancelled) return completion;
    std::vector<std::size_t> used;
    for (const lc::FrameMetadata::Plane& plane : frame.planes()) used.push_back(plane.bytesused);
    maps_[done.index].Sync(true);
    being_read_[done.index] = true;
    completion.bytes = maps_[done.index].Bytes(used);
    return completion;
  }

  std::shared_ptr<lc::CameraManager> manager_;
  std::shared_ptr<lc::Camera> camera_;
  LibcameraEntry entry_;
  std::unique_ptr<lc::CameraConfiguration> config_;
  lc::Stream* stream_ = nullptr;
  std::unique_ptr<lc::FrameBufferAllocator> allocator_;
  std::vector<std::unique_ptr<lc::Request>> requests_;
  std::vector<BufferMap> maps_;
  std::vector<bool> being_read_;
  std::vector<std::pair<unsigned, lc::ControlValue>> fixed_;
  bool started_ = false;
  std::mutex mutex_;
  std::condition_variable_any arrived_;
  std::deque<Done> done_;
  bool removed_ = false;
};

class RealLibcamera final : public LibcameraSystem {
 public:
  Result<std::vector<LibcameraEntry>> List() override {
    SCAN_CHECK(LookAnew());
    std::vector<LibcameraEntry> entries;
    for (const std::shared_ptr<lc::Camera>& camera : manager_->cameras())
      entries.push_back(EntryOf(*camera));
    return entries;
  }

  Result<std::unique_ptr<LibcameraDevice>> Open(const std::string& id) override {
    if (!manager_) SCAN_CHECK(LookAnew());
    std::shared_ptr<lc::Camera> camera = manager_->get(id);
    if (!camera)
      return DeviceFault("the camera is not there", "libcamera, " + id, "check its cable");
    if (const int code = camera->acquire(); code < 0)
      return Fault("another program holds the camera", code, id);
    return std::make_unique<RealDevice>(manager_, std::move(camera));
  }

 private:
  // Its own messages of new cameras need a running udevd; enumerating anew does not.
  Status LookAnew() {
    manager_.reset();  // only one may exist in a process
    auto manager = std::make_shared<lc::CameraManager>();
    if (const int code = manager->start(); code < 0)
      return Fault("it cannot be started", code, "camera manager");
    manager_ = std::shared_ptr<lc::CameraManager>(manager.get(),
                                                  [manager](lc::CameraManager* m) { m->stop(); });
    return {};
  }

  std::shared_ptr<lc::CameraManager> manager_;
};

}  // namespace

std::shared_ptr<LibcameraSystem> MakeRealLibcamera() { return std::make_shared<RealLibcamera>(); }

std::string LibcameraVersion() { return lc::CameraManager::version(); }

}  // namespace scan
