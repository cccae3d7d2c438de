#include "drivers/camera/v4l2/v4l2_camera.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/base/durations.h"
#include "drivers/base/log.h"
#include "drivers/camera/v4l2/convert.h"

namespace scan {
namespace {

constexpr std::uint32_t kBuffers = 4;
constexpr int kMaxFrames = 40;  // looked at in one call; a camera that needs more is broken
constexpr int kMaxDamaged = 5;
constexpr std::int64_t kUnknownIntervalNs = 100'000'000;
constexpr std::int64_t kLookAgainNs = 100'000'000;  // for a camera that is gone
constexpr double kExposureUnitUs = 100;             // of V4L2_CID_EXPOSURE_ABSOLUTE
constexpr double kMaxRounding = 0.01;               // the gate's tolerance of settings

// A setting in units of its control. Errors: bad_input out of range or between two steps.
Result<std::int64_t> StepsOf(double value, double unit, const V4l2Control* control,
                             const char* name, const std::string& where) {
  const double low = control ? static_cast<double>(control->min) * unit : 0;
  const double high = control ? static_cast<double>(control->max) * unit : 0;
  if (!(value >= low && value <= high && value > 0))
    return BadInput(fmt::format("{} {} is out of range", name, value), where,
                    fmt::format("the camera takes {} to {}", std::max(low, unit), high));
  const double steps = std::round(value / unit);
  if (std::abs(steps * unit - value) > kMaxRounding * value)
    return BadInput(fmt::format("{} {} is between two steps of the camera", name, value), where,
                    fmt::format("choose {} or {}", std::floor(value / unit) * unit,
                                std::ceil(value / unit) * unit));
  return static_cast<std::int64_t>(steps);
}

}  // namespace

Result<std::unique_ptr<V4l2Camera>> V4l2Camera::Open(V4l2CameraOptions options,
                                                     std::shared_ptr<V4l2System> system,
                                                     std::shared_ptr<Clock> clock) {
  std::unique_ptr<V4l2Camera> camera(
      new V4l2Camera(std::move(options), std::move(system), std::move(clock)));
  camera->info_.id = camera->options_.id;
  const double wait_ms = std::exchange(camera->options_.config.reconnect_ms, 0);
  SCAN_CHECK(camera->EnsureOpen({}));
  camera->options_.config.reconnect_ms = wait_ms;
  return camera;
}

void V4l2Camera::Close() {
  stream_.reset();
  device_.reset();
}

template <class T, class Work>
Result<T> V4l2Camera::WithRecovery(std::stop_token stop, Work work) {
  for (int attempt = 1;; ++attempt) {
    const Status open = EnsureOpen(stop);
    Result<T> result = open ? work() : Result<T>(tl::unexpected(open.error()));
    if (result || result.error().kind != ErrorKind::device) return result;
    Close();
    if (attempt == 2) return result;
    ++counters_.restarts;
    Log(LogLevel::warning, "camera_recovery",
        {{"camera", options_.id}, {"fault", ToString(result.error())}});
  }
}

Status V4l2Camera::EnsureOpen(std::stop_token stop) {
  if (stream_) return {};
  const auto set_up = [&]() -> Status {
    SCAN_TRY(device_, WaitForDevice(stop));
    SCAN_TRY(controls_, ListControls(*device_));
    FormatWish wish{options_.config.pixel_format, options_.w, options_.h,
                    NsOfMs(options_.config.frame_interval_ms)};
    SCAN_TRY(stream_, V4l2Stream::Start(system_, *device_, wish, kBuffers));
    // While it streams: some cameras forget their controls when a stream starts.
    if (options_.config.lock_automatics) SCAN_CHECK(LockAutomatics());
    SCAN_CHECK(ApplyConfiguredControls());
    SCAN_CHECK(ApplySettings(asked_));
    SCAN_TRY(applied_, ReadSettings());
    return {};
  };
  if (const Status ready = set_up(); !ready) {
    Close();
    return ready;
  }
  // What was the largest size at first is asked for from now on.
  info_.w = options_.w = stream_->format().w;
  info_.h = options_.h = stream_->format().h;
  info_.model = device_->card();
  last_sequence_.reset();
  last_stamp_ns_ = 0;
  if (counters_.frames > 0) sequence_base_ = sequence_ + 1;
  return {};
}

Result<std::unique_ptr<V4l2Device>> V4l2Camera::WaitForDevice(std::stop_token stop) {
  const CameraSelector selector{options_.config.port, options_.config.name};
  const std::int64_t until_ns = clock_->Now().mono_ns + NsOfMs(options_.config.reconnect_ms);
  for (;;) {
    auto device = OpenSelected(system_, selector);
    if (device || device.error().kind != ErrorKind::device) return device;
    if (clock_->Now().mono_ns >= until_ns) return device;
    if (!clock_->SleepFor(kLookAgainNs, stop)) return Cancelled("camera " + options_.id);
  }
}

Status V4l2Camera::LockAutomatics() {
  struct Off {
    std::uint32_t id;
    std::vector<std::int64_t> values;  // the first that the camera has
  };
  const Off offs[] = {
      {V4L2_CID_EXPOSURE_AUTO, {V4L2_EXPOSURE_MANUAL, V4L2_EXPOSURE_SHUTTER_PRIORITY}},
      {V4L2_CID_EXPOSURE_AUTO_PRIORITY, {0}},
      {V4L2_CID_AUTOGAIN, {0}},
      {V4L2_CID_AUTO_WHITE_BALANCE, {0}},
      {V4L2_CID_FOCUS_AUTO, {0}},
      {V4L2_CID_HUE_AUTO, {0}},
      {V4L2_CID_AUTOBRIGHTNESS, {0}},
      {V4L2_CID_ISO_SENSITIVITY_AUTO, {V4L2_ISO_SENSITIVITY_MANUAL}}};
  for (const Off& off : offs) {
    const V4l2Control* control = FindControl(controls_, off.id);
    if (!control || control->read_only) continue;
    const auto has = [&](std::int64_t value) {
      return control->type != ControlType::menu ||
             std::any_of(control->menu.begin(), control->menu.end(),
                         [&](const ControlMenuEntry& entry) { return entry.value == value; });
    };
    const auto value = std::find_if(off.values.begin(), off.values.end(), has);
    if (value == off.values.end()) continue;
    SCAN_CHECK(Write(*control, *value));
  }
  return {};
}

Status V4l2Camera::ApplyConfiguredControls() {
  const auto is_switch = [](const V4l2Control& control) {
    return control.type == ControlType::boolean || control.type == ControlType::menu;
  };
  for (const bool switches : {true, false}) {  // an automatic must be off before its value is set
    for (const auto& [name, text] : options_.config.controls) {
      const V4l2Control* control = FindControl(controls_, name);
      if (!control) {
        std::string names;
        for (const V4l2Control& known : controls_) names += " " + known.name;
        return BadInput(fmt::format("the camera has no control '{}'", name), device_->Where(),
                        names.empty() ? "it has none" : "choose from:" + names);
      }
      if (is_switch(*control) != switches) continue;
      SCAN_TRY(const std::int64_t value, ParseControlValue(*control, text));
      SCAN_CHECK(Write(*control, value));
    }
  }
  return {};
}

Status V4l2Camera::Write(const V4l2Control& control, std::int64_t value) {
  if (control.type != ControlType::button) {
    SCAN_TRY(const std::int64_t before, ReadControl(*device_, control));
    if (before == value) return {};
  }
  SCAN_TRY(const std::int64_t made, WriteControl(*device_, control, value));
  ExpectUnsettledFrames();
  if (made == value) return {};
  return BadInput(fmt::format("{} was set to {}, the camera made it {}", control.name, value, made),
                  device_->Where(), "choose a value that the camera has");
}

const V4l2Control* V4l2Camera::ExposureControl() const {
  return FindControl(controls_, std::uint32_t{V4L2_CID_EXPOSURE_ABSOLUTE});
}

const V4l2Control* V4l2Camera::GainControl() const {
  if (options_.config.unity_gain <= 0) return nullptr;
  const V4l2Control* gain = FindControl(controls_, std::uint32_t{V4L2_CID_GAIN});
  return gain ? gain : FindControl(controls_, std::uint32_t{V4L2_CID_ANALOGUE_GAIN});
}

Status V4l2Camera::CheckSettings(const CameraSettings& settings) const {
  const std::string where = "camera " + options_.id;
  if (settings.exposure_us) {
    const double us = *settings.exposure_us;
    if (const V4l2Control* control = ExposureControl()) {
      SCAN_CHECK(StepsOf(us, kExposureUnitUs, control, "exposure_us", where));
    } else if (!(us >= 1 && us <= 10e6)) {
      return BadInput(fmt::format("exposure_us {} is out of range", us), where,
                      "exposure is 1 to 10000000 us");
    }
  }
  if (settings.gain) {
    const double gain = *settings.gain;
    if (const V4l2Control* control = GainControl()) {
      SCAN_CHECK(StepsOf(gain, 1 / options_.config.unity_gain, control, "gain", where));
    } else if (!(gain >= 1 && gain <= 64)) {
      return BadInput(fmt::format("gain {} is out of range", gain), where, "gain is 1 to 64");
    }
  }
  return {};
}

Status V4l2Camera::ApplySettings(const CameraSettings& settings) {
  const std::string where = "camera " + options_.id;
  if (const V4l2Control* control = ExposureControl(); control && settings.exposure_us) {
    SCAN_TRY(const std::int64_t steps,
             StepsOf(*settings.exposure_us, kExposureUnitUs, control, "exposure_us", where));
    SCAN_CHECK(Write(*control, steps));
  }
  if (const V4l2Control* control = GainControl(); control && settings.gain) {
    SCAN_TRY(const std::int64_t steps,
             StepsOf(*settings.gain, 1 / options_.config.unity_gain, control, "gain", where));
    SCAN_CHECK(Write(*control, steps));
  }
  return {};
}

Result<AppliedSettings> V4l2Camera::ReadSettings() {
  AppliedSettings settings;
  if (const V4l2Control* control = ExposureControl()) {
    SCAN_TRY(const std::int64_t steps, ReadControl(*device_, *control));
    settings.exposure_us = kExposureUnitUs * static_cast<double>(steps);
  }
  if (const V4l2Control* control = GainControl()) {
    SCAN_TRY(const std::int64_t steps, ReadControl(*device_, *control));
    settings.gain = static_cast<double>(steps) / options_.config.unity_gain;
  }
  return settings;
}

Result<AppliedSettings> V4l2Camera::Configure(const CameraSettings& settings) {
  SCAN_CHECK(CheckSettings(settings));
  if (settings.exposure_us) asked_.exposure_us = settings.exposure_us;
  if (settings.gain) asked_.gain = settings.gain;
  return WithRecovery<AppliedSettings>({}, [&]() -> Result<AppliedSettings> {
    SCAN_CHECK(ApplySettings(asked_));
    SCAN_TRY(applied_, ReadSettings());
    return applied_;
  });
}

void V4l2Camera::ExpectUnsettledFrames() {
  settings_changed_ns_ = clock_->Now().mono_ns;
  unsettled_frames_ = options_.config.settings_frames;
  longest_exposure_us_ = std::max(longest_exposure_us_, applied_.exposure_us.value_or(0));
}

std::int64_t V4l2Camera::ExposureNs() const {
  return std::llround(1e3 * std::max(applied_.exposure_us.value_or(0), longest_exposure_us_));
}

std::int64_t V4l2Camera::FrameTimeNs() const {
  const std::int64_t interval_ns = stream_->format().interval_ns;
  return std::max(interval_ns > 0 ? interval_ns : kUnknownIntervalNs, ExposureNs());
}

ExposureBound V4l2Camera::BoundOf(const MappedFrame& frame) const {
  // Without an exposure time: it is no longer than the time between two frames.
  const std::int64_t frame_ns = FrameTimeNs();
  const std::int64_t exposure_ns = applied_.exposure_us ? ExposureNs() : frame_ns;
  const std::int64_t stamp_ns = std::min(frame.stamp_ns, frame.taken_ns);
  std::int64_t first_bytes_ns = frame.arrived_after_ns - frame_ns;
  if (frame.stamp == StampKind::start_of_frame) first_bytes_ns = stamp_ns;
  if (frame.stamp == StampKind::end_of_frame) first_bytes_ns = stamp_ns - frame_ns;
  ExposureBound bound;
  bound.not_before_ns = first_bytes_ns - exposure_ns - options_.config.latency_frames * frame_ns;
  bound.not_after_ns = frame.stamp == StampKind::end_of_frame ? stamp_ns : frame.taken_ns;
  bound.source = ExposureSource::sensor;
  return bound;
}

bool V4l2Camera::FollowsThePrevious(const MappedFrame& frame) {
  const bool first = !last_sequence_;
  const auto ahead =
      first ? 1 : static_cast<std::int32_t>(frame.sequence - *last_sequence_);  // wraps
  // Some drivers compute a stamp ahead, within the frame (vivid: the end that is to be expected).
  const bool stamped = frame.stamp != StampKind::none;
  if (ahead <= 0 || (stamped && frame.stamp_ns <= last_stamp_ns_) ||
      (stamped && frame.stamp_ns > frame.taken_ns + FrameTimeNs()))
    return false;
  sequence_ =
      first ? sequence_base_ + frame.sequence : sequence_ + static_cast<std::uint64_t>(ahead);
  last_sequence_ = frame.sequence;
  last_stamp_ns_ = frame.stamp_ns;
  return true;
}

std::optional<std::string> V4l2Camera::FindDamage(const MappedFrame& frame) const {
  const StreamFormat& format = stream_->format();
  const std::size_t whole = PictureBytes(*format.format, format.w, format.h, format.bytes_per_line);
  const std::size_t size = frame.bytes().size();
  std::optional<std::string> damage;
  if (frame.flagged) damage = "the driver marks the frame as damaged";
  if (whole > 0 && size != whole && size != format.size_image)
    damage = fmt::format("the frame has {} bytes, a whole one has {}", size, whole);
  if (whole > 0 && size < whole) damage = fmt::format("the frame has {} of {} bytes", size, whole);
  if (size == 0) damage = "the frame is empty";
  return damage;
}

Result<std::optional<Frame>> V4l2Camera::Judge(const MappedFrame& mapped, std::int64_t asked_ns,
                                               Damage& damage) {
  if (!FollowsThePrevious(mapped)) {
    ++counters_.disordered;
    damage.Add(fmt::format("sequence {} or its time stamp does not follow", mapped.sequence));
    return std::nullopt;
  }
  Frame frame;
  frame.exposure = BoundOf(mapped);
  if (frame.exposure.not_before_ns < asked_ns ||
      frame.exposure.not_before_ns <= settings_changed_ns_) {
    ++counters_.stale;
    return std::nullopt;
  }
  if (unsettled_frames_ > 0) {
    --unsettled_frames_;
    ++counters_.unsettled;
    return std::nullopt;
  }
  std::optional<std::string> fault = FindDamage(mapped);
  if (!fault) {
    SCAN_TRY(fault, AddFileOf(stream_->format(), mapped.bytes(), frame));
  }
  if (fault) {
    ++counters_.damaged;
    damage.Add(*fault);
    SCAN_TRY(const bool unchanged, stream_->FormatUnchanged());
    if (unchanged) return std::nullopt;
    return DeviceFault("the camera changed its format in mid-stream", device_->Where(),
                       "let no other program set up the camera");
  }
  SCAN_TRY(const AppliedSettings now, ReadSettings());
  if (now != applied_) {  // somebody else changed it: nobody knows which one this frame has
    ExpectUnsettledFrames();
    applied_ = now;
    return std::nullopt;
  }
  longest_exposure_us_ = applied_.exposure_us.value_or(0);
  frame.sensor_sequence = sequence_;
  frame.applied = applied_;
  return frame;
}

Result<Frame> V4l2Camera::GrabOnce(std::int64_t asked_ns, std::stop_token stop) {
  const std::int64_t silence_ns = std::max(NsOfMs(options_.config.timeout_ms), 3 * FrameTimeNs());
  const std::int64_t end_ns = clock_->Now().mono_ns + silence_ns + kMaxFrames * FrameTimeNs();
  Damage damage;
  for (int i = 0; i < kMaxFrames && damage.count < kMaxDamaged; ++i) {
    const std::int64_t deadline_ns = std::min(end_ns, clock_->Now().mono_ns + silence_ns);
    SCAN_TRY(const MappedFrame mapped, stream_->Next(*clock_, deadline_ns, stop));
    ++counters_.frames;
    SCAN_TRY(auto frame, Judge(mapped, asked_ns, damage));
    if (frame) return std::move(*frame);
  }
  if (damage.count > 0)
    return DeviceFault(fmt::format("{} damaged frames, the last: {}", damage.count, damage.last),
                       device_->Where(),
                       "check cable, hub and power supply; a lower frame rate may help");
  return DeviceFault(
      fmt::format("none of {} frames was exposed after it was asked for", kMaxFrames),
      device_->Where(), "lower latency_frames or settings_frames; the time stamps may not advance");
}

Result<Frame> V4l2Camera::Grab(std::stop_token stop) {
  if (stop.stop_requested()) return Cancelled("camera " + options_.id);
  const std::int64_t asked_ns = clock_->Now().mono_ns;
  return WithRecovery<Frame>(stop, [&] { return GrabOnce(asked_ns, stop); });
}

}  // namespace scan
