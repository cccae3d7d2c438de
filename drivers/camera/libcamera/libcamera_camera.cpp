#include "drivers/camera/libcamera/libcamera_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/base/durations.h"
#include "drivers/camera/libcamera/libcamera_format.h"
#include "drivers/camera/v4l2/convert.h"

namespace scan {
namespace {

constexpr int kMaxFrames = 40;  // looked at in one call; a camera that needs more is broken
constexpr int kMaxDamaged = 5;
constexpr std::int64_t kUnknownIntervalNs = 100'000'000;
// For a camera that is gone; each look starts libcamera anew.
constexpr std::int64_t kLookAgainNs = 500'000'000;
constexpr double kTolerance = 0.01;  // the gate's tolerance of settings
constexpr char kExposure[] = "ExposureTime";
constexpr char kGain[] = "AnalogueGain";

Result<LibcameraRole> RoleOf(const std::string& word) {
  if (word == "still") return LibcameraRole::still;
  if (word == "viewfinder") return LibcameraRole::viewfinder;
  if (word == "raw") return LibcameraRole::raw;
  return BadInput(fmt::format("'{}' is no role of a stream", word), "camera.libcamera.role",
                  "choose still, viewfinder or raw");
}

bool Differs(const std::optional<double>& asked, const std::optional<double>& reported) {
  return asked && reported && std::abs(*reported - *asked) > kTolerance * std::abs(*asked);
}

Status CheckRange(const std::optional<double>& value, const LibcameraRange& range, const char* name,
                  const std::string& where) {
  if (!value || (*value >= range.min && *value <= range.max && *value > 0)) return {};
  return BadInput(fmt::format("{} {} is out of range", name, *value), where,
                  fmt::format("the camera takes {} to {}", range.min, range.max));
}

}  // namespace

Result<LibcameraEntry> FindLibcamera(const std::vector<LibcameraEntry>& cameras,
                                     const std::string& wanted) {
  std::vector<LibcameraEntry> fitting;
  std::string names;
  for (const LibcameraEntry& camera : cameras) {
    names += fmt::format(" '{}' ({})", camera.id, camera.model);
    if (camera.id == wanted) return camera;
    if (wanted.empty() || camera.model == wanted) fitting.push_back(camera);
  }
  if (fitting.size() == 1) return fitting.front();
  const std::string where = wanted.empty() ? "libcamera" : "libcamera, " + wanted;
  if (!fitting.empty())
    return BadInput("several cameras fit", where, "name one of these by its id:" + names);
  return DeviceFault("the camera is not there", where,
                     names.empty() ? "check its cable, and that the program may use /dev/video*, "
                                     "/dev/media* and /dev/dma_heap (group video)"
                                   : "connected are:" + names);
}

Result<std::unique_ptr<LibcameraCamera>> LibcameraCamera::Open(
    LibcameraOptions options, std::shared_ptr<LibcameraSystem> system,
    std::shared_ptr<Clock> clock) {
  std::unique_ptr<LibcameraCamera> camera(
      new LibcameraCamera(std::move(options), std::move(system), std::move(clock)));
  camera->info_.id = camera->options_.id;
  camera->asked_.lock_automatics = camera->options_.config.lock_automatics;
  SCAN_CHECK(camera->EnsureOpen({}));
  return camera;
}

Status LibcameraCamera::EnsureOpen(std::stop_token stop) {
  if (device_) return {};
  const auto set_up = [&]() -> Status {
    SCAN_TRY(device_, WaitForDevice(stop));
    SCAN_TRY(stream_, ConfigureStream());
    controls_ = device_->Controls();
    SCAN_CHECK(device_->Start(options_.config.controls));
    generation_of_request_.assign(static_cast<std::size_t>(stream_.requests), generation_);
    for (int request = 0; request < stream_.requests; ++request) SCAN_CHECK(Queue(request));
    return {};
  };
  if (const Status ready = set_up(); !ready) {
    device_.reset();
    return ready;
  }
  // What was the largest size at first is asked for from now on.
  info_.w = options_.w = stream_.format.w;
  info_.h = options_.h = stream_.format.h;
  info_.model = device_->entry().model;
  last_sequence_.reset();
  last_stamp_ns_ = interval_ns_ = 0;
  if (counters_.frames > 0) sequence_base_ = sequence_ + 1;
  ExpectUnsettledFrames();
  return {};
}

Result<std::unique_ptr<LibcameraDevice>> LibcameraCamera::WaitForDevice(std::stop_token stop) {
  const std::int64_t until_ns = clock_->Now().mono_ns + NsOfMs(options_.config.reconnect_ms);
  for (;;) {
    const auto open = [&]() -> Result<std::unique_ptr<LibcameraDevice>> {
      SCAN_TRY(const auto cameras, system_->List());
      SCAN_TRY(const LibcameraEntry entry, FindLibcamera(cameras, options_.config.camera));
      return system_->Open(entry.id);
    };
    auto device = open();
    if (device || device.error().kind != ErrorKind::device) return device;
    if (clock_->Now().mono_ns >= until_ns) return device;
    if (!clock_->SleepFor(kLookAgainNs, stop)) return Cancelled("camera " + options_.id);
  }
}

Result<LibcameraStream> LibcameraCamera::ConfigureStream() {
  SCAN_TRY(LibcameraRole role, RoleOf(options_.config.role));
  std::vector<LibcameraOffer> offers = device_->Offers(role);
  if (offers.empty() && role == LibcameraRole::still) {
    role = LibcameraRole::viewfinder;
    offers = device_->Offers(role);
  }
  FormatWish wish{{}, options_.w, options_.h, 0};
  const std::string& wanted = options_.config.pixel_format;
  if (const PixelFormat* format = FindLibcameraFormat(wanted); format)
    wish.format = format->name;
  else if (!wanted.empty())
    return BadInput(fmt::format("'{}' is no pixel format that becomes a picture here", wanted),
                    "camera.libcamera.pixel_format", "see 'scanstation device libcamera list'");
  std::vector<OfferedFormat> understood;
  std::map<std::uint32_t, std::string> names;
  for (const LibcameraOffer& offer : offers) {
    const PixelFormat* format = FindLibcameraFormat(offer.format);
    if (!format) continue;
    OfferedFormat entry{};
    entry.fourcc = format->fourcc;
    entry.description = offer.format;
    for (const auto& [w, h] : offer.sizes) entry.sizes.push_back({w, h, {}});
    names[format->fourcc] = offer.format;
    understood.push_back(std::move(entry));
  }
  SCAN_TRY(const FormatChoice choice,
           ChooseFormat(understood, wish, "camera " + device_->entry().id));
  return device_->Configure(role, names.at(choice.format->fourcc), choice.w, choice.h);
}

Status LibcameraCamera::Queue(int request) {
  generation_of_request_.at(static_cast<std::size_t>(request)) = generation_;
  RequestSettings settings = asked_;
  if (!controls_.contains(kExposure)) settings.exposure_us.reset();
  if (!controls_.contains(kGain)) settings.gain.reset();
  return device_->Queue(request, settings);
}

Status LibcameraCamera::CheckSettings(const CameraSettings& settings) const {
  const std::string where = "camera " + options_.id;
  const auto exposure = controls_.find(kExposure), gain = controls_.find(kGain);
  SCAN_CHECK(CheckRange(settings.exposure_us,
                        exposure != controls_.end() ? exposure->second : LibcameraRange{1, 10e6},
                        "exposure_us", where));
  return CheckRange(settings.gain, gain != controls_.end() ? gain->second : LibcameraRange{1, 64},
                    "gain", where);
}

Result<AppliedSettings> LibcameraCamera::Configure(const CameraSettings& settings) {
  SCAN_CHECK(EnsureOpen({}));
  SCAN_CHECK(CheckSettings(settings));
  RequestSettings asked = asked_;
  if (settings.exposure_us) asked.exposure_us = settings.exposure_us;
  if (settings.gain) asked.gain = settings.gain;
  if (asked.exposure_us == asked_.exposure_us && asked.gain == asked_.gain) return reported_;
  asked_ = asked;
  ++generation_;
  reported_ = {};
  ExpectUnsettledFrames();
  return reported_;
}

void LibcameraCamera::ExpectUnsettledFrames() {
  settings_changed_ns_ = clock_->Now().mono_ns;
  unsettled_frames_ = options_.config.settings_frames;
}

std::int64_t LibcameraCamera::FrameTimeNs(const LibcameraCompletion& done) const {
  if (done.frame_duration_ns && *done.frame_duration_ns > 0) return *done.frame_duration_ns;
  return interval_ns_ > 0 ? interval_ns_ : kUnknownIntervalNs;
}

ExposureBound LibcameraCamera::BoundOf(const LibcameraCompletion& done) const {
  const std::int64_t frame_ns = FrameTimeNs(done);
  const std::int64_t asked_ns = std::llround(1e3 * asked_.exposure_us.value_or(0));
  const std::int64_t exposure_ns =
      done.exposure_us ? std::llround(1e3 * *done.exposure_us) : std::max(asked_ns, frame_ns);
  const std::int64_t held_ns =
      exposure_ns + options_.config.latency_frames * std::max(frame_ns, exposure_ns);
  ExposureBound bound;
  bound.not_after_ns = done.completed_ns;
  // A stamp behind the completion is of another clock (some drivers count suspended time).
  if (done.sensor_timestamp_ns && *done.sensor_timestamp_ns <= done.completed_ns) {
    bound.not_before_ns = *done.sensor_timestamp_ns - held_ns;
    bound.source = ExposureSource::sensor;
  } else {
    bound.not_before_ns = done.completed_ns - 2 * frame_ns - held_ns;
    bound.source = ExposureSource::ptp_bound;
  }
  return bound;
}

void LibcameraCamera::NoteInterval(const LibcameraCompletion& done) {
  const std::int64_t stamp_ns = done.sensor_timestamp_ns.value_or(done.completed_ns);
  if (last_sequence_) {
    const auto ahead = static_cast<std::int32_t>(done.sequence - *last_sequence_);  // wraps
    if (ahead > 0 && stamp_ns > last_stamp_ns_) interval_ns_ = (stamp_ns - last_stamp_ns_) / ahead;
    sequence_ += ahead > 0 ? static_cast<std::uint64_t>(ahead) : 1;
  } else {
    sequence_ = sequence_base_ + done.sequence;
  }
  last_sequence_ = done.sequence;
  last_stamp_ns_ = stamp_ns;
}

// Whether the frame has the settings asked for, as far as anything can tell.
bool LibcameraCamera::Settled(const LibcameraCompletion& done) {
  if (generation_of_request_.at(static_cast<std::size_t>(done.request)) != generation_)
    return false;
  if (Differs(asked_.exposure_us, done.exposure_us) || Differs(asked_.gain, done.gain))
    return false;
  const bool told = (!asked_.exposure_us || done.exposure_us) && (!asked_.gain || done.gain);
  if (!told && unsettled_frames_ > 0) {
    --unsettled_frames_;
    return false;
  }
  return true;
}

std::optional<std::string> LibcameraCamera::FindDamage(const LibcameraCompletion& done) const {
  const StreamFormat& format = stream_.format;
  const std::size_t whole = PictureBytes(*format.format, format.w, format.h, format.bytes_per_line);
  if (done.damaged) return "the driver marks the frame as damaged";
  if (done.bytes.empty()) return "the frame is empty";
  if (done.bytes.size() < whole)
    return fmt::format("the frame has {} of {} bytes", done.bytes.size(), whole);
  return std::nullopt;
}

Result<std::optional<Frame>> LibcameraCamera::Judge(const LibcameraCompletion& done,
                                                    std::int64_t asked_ns, std::string& damage) {
  if (done.cancelled)
    return DeviceFault("libcamera cancelled the request", "camera " + options_.id,
                       "check the camera and its cable");
  NoteInterval(done);
  Frame frame;
  frame.exposure = BoundOf(done);
  if (frame.exposure.not_before_ns < asked_ns ||
      frame.exposure.not_before_ns <= settings_changed_ns_) {
    ++counters_.stale;
    return std::nullopt;
  }
  if (done.startup || !Settled(done)) {
    ++counters_.unsettled;
    return std::nullopt;
  }
  std::optional<std::string> fault = FindDamage(done);
  if (!fault) {
    SCAN_TRY(fault, AddFileOf(stream_.format, done.bytes, frame));
  }
  if (fault) {
    ++counters_.damaged;
    damage = *fault;
    return std::nullopt;
  }
  frame.sensor_sequence = sequence_;
  frame.applied = reported_ = {done.exposure_us, done.gain};
  return frame;
}

Result<Frame> LibcameraCamera::GrabOpened(std::int64_t asked_ns, std::stop_token stop) {
  const std::int64_t exposure_ns = std::llround(1e3 * asked_.exposure_us.value_or(0));
  const std::int64_t silence_ns =
      NsOfMs(options_.config.timeout_ms) + 4 * std::max(exposure_ns, interval_ns_);
  std::string damage, last_reported = "nothing";
  const std::int64_t damaged_before = counters_.damaged;
  for (int i = 0; i < kMaxFrames && counters_.damaged - damaged_before < kMaxDamaged; ++i) {
    SCAN_TRY(const auto done, device_->Next(clock_->Now().mono_ns + silence_ns, stop));
    if (!done)
      return DeviceFault(
          fmt::format("the camera sent no frame for {:.1f} s", 1e-9 * double(silence_ns)),
          "camera " + options_.id, "check its cable and power supply");
    ++counters_.frames;
    if (done->exposure_us) last_reported = fmt::format("{:g} us", *done->exposure_us);
    auto judged = Judge(*done, asked_ns, damage);
    const Status queued = Queue(done->request);  // its bytes are not needed any more
    SCAN_TRY(auto frame, std::move(judged));
    SCAN_CHECK(queued);
    if (frame) return std::move(*frame);
  }
  if (!damage.empty())
    return DeviceFault("damaged frames, the last: " + damage, "camera " + options_.id,
                       "check cable, hub and power supply; a lower frame rate may help");
  return DeviceFault(fmt::format("none of {} frames was exposed after it was asked for with the "
                                 "settings asked for (exposure reported: {})",
                                 kMaxFrames, last_reported),
                     "camera " + options_.id,
                     "lower latency_frames or settings_frames, or choose another exposure");
}

Result<Frame> LibcameraCamera::Grab(std::stop_token stop) {
  if (stop.stop_requested()) return Cancelled("camera " + options_.id);
  const std::int64_t asked_ns = clock_->Now().mono_ns;
  SCAN_CHECK(EnsureOpen(stop));
  Result<Frame> frame = GrabOpened(asked_ns, stop);
  if (!frame && frame.error().kind == ErrorKind::device) device_.reset();
  return frame;
}

}  // namespace scan
