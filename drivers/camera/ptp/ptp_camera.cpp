#include "drivers/camera/ptp/ptp_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/base/durations.h"
#include "drivers/camera/ptp/ptp_device.h"
#include "drivers/camera/ptp/ptp_picture.h"

namespace scan {
namespace {

constexpr int kMaxEvents = 1000;  // of one draining: a camera that never falls silent is at fault
constexpr int kWaitMs = 100;      // a cancel is seen so soon
constexpr int kSurplusMs = 200;   // without a further file an exposure is complete
constexpr int kReopenMs = 500;
constexpr double kQuietMs = 2000;  // without a file, after a shot that was given up

// Marked times are rounded (1/125 is 1/128 s): what comes before this share is of another exposure.
constexpr double kLeastExposure = 0.7;

}  // namespace

Result<std::unique_ptr<PtpCamera>> PtpCamera::Open(PtpCameraOptions options,
                                                   std::shared_ptr<PhotoSystem> system,
                                                   std::unique_ptr<ShutterLines> lines,
                                                   std::shared_ptr<Clock> clock) {
  std::unique_ptr<PtpCamera> camera(
      new PtpCamera(std::move(options), std::move(system), std::move(lines), std::move(clock)));
  camera->info_ = {camera->options_.id, "", camera->options_.w, camera->options_.h};
  SCAN_CHECK(camera->OpenOnce());
  return camera;
}

tl::unexpected<Error> PtpCamera::Fault(const PhotoFault& fault) const {
  return tl::unexpected(PtpError(fault, where_));
}

Status PtpCamera::OpenOnce() {
  const auto devices = system_->List();
  if (!devices) return tl::unexpected(PtpError(devices.error(), "USB"));
  SCAN_TRY(const PhotoDevice device, FindPhotoDevice(*devices, options_.config));
  where_ = Describe(device);
  SCAN_TRY(auto camera, OpenPhotoDevice(*system_, device));
  SCAN_TRY(PtpSettings settings, PtpSettings::Plan(*camera, options_.config, asked_, where_));
  SCAN_TRY(const PtpReadiness ready, ReadReadiness(*camera, where_));
  SCAN_CHECK(CheckReadiness(ready, options_.config, !settings.into_ram(), where_));
  // The same camera from now on, should it leave and come back beside an equal one.
  options_.config.port = device.port;
  info_.model = device.model;
  camera_ = std::make_unique<WatchedPhotoCamera>(std::move(camera));
  settings_ = std::move(settings);
  return {};
}

Status PtpCamera::EnsureOpen(std::stop_token stop) {
  if (camera_ && camera_->broken()) camera_.reset();
  if (camera_) return {};
  const std::int64_t deadline_ns = Now() + NsOfMs(options_.config.reconnect_ms);
  for (;;) {
    const Status opened = OpenOnce();
    if (opened) {
      ++counters_.reopened;
      unsettled_ = true;
      return {};
    }
    if (opened.error().kind != ErrorKind::device || Now() >= deadline_ns) return opened;
    if (!clock_->SleepFor(NsOfMs(kReopenMs), stop)) return Cancelled(where_);
  }
}

PhotoStatus PtpCamera::HandleStale(const PhotoEvent& event) {
  if (event.kind != PhotoEventKind::file_added) return {};
  ++counters_.stale;
  // Left in the camera's memory it would be taken for a later picture, and fill it up.
  if (settings_ && settings_->into_ram()) Remove(event.file);
  return {};
}

PhotoStatus PtpCamera::Pump(int timeout_ms) {
  for (int k = 0; k < kMaxEvents; ++k) {
    const auto event = camera_->WaitEvent(timeout_ms);
    if (!event) {
      if (event.error().kind == PhotoFaultKind::busy) return {};
      return tl::unexpected(event.error());
    }
    if (event->kind == PhotoEventKind::none) return {};
    if (auto handled = HandleStale(*event); !handled) return handled;
    timeout_ms = 0;
  }
  return tl::unexpected(
      PhotoFault{PhotoFaultKind::transfer, "the camera sends events without end"});
}

// Everything that earlier exposures left; after a shot that was given up its files are waited for.
Status PtpCamera::Drain(std::stop_token stop) {
  if (unsettled_) {
    std::int64_t quiet_ns = std::max(Now(), given_up_end_ns_);
    const std::int64_t end_ns = quiet_ns + NsOfMs(options_.config.picture_ms);
    while (Now() < std::min(end_ns, quiet_ns + NsOfMs(kQuietMs))) {
      if (stop.stop_requested()) return Cancelled(where_);
      const std::int64_t stale = counters_.stale;
      if (const auto pumped = Pump(kWaitMs); !pumped) return Fault(pumped.error());
      if (counters_.stale != stale) quiet_ns = std::max(Now(), quiet_ns);
    }
    unsettled_ = false;
  }
  if (const auto pumped = Pump(0); !pumped) return Fault(pumped.error());
  return {};
}

Result<AppliedSettings> PtpCamera::Hold() {
  return settings_->Hold(*camera_, *clock_, [this](int timeout_ms) { return Pump(timeout_ms); });
}

Result<AppliedSettings> PtpCamera::ConfigureOnce(const CameraSettings& wish) {
  SCAN_TRY(PtpSettings plan, PtpSettings::Plan(*camera_, options_.config, wish, where_));
  std::swap(*settings_, plan);
  auto held = Hold();
  if (held) {
    asked_ = wish;
  } else {
    std::swap(*settings_, plan);
  }
  return held;
}

// The camera is open when `work` begins, and opened again once when it breaks the connection.
template <class T, class Work>
Result<T> PtpCamera::WithRecovery(std::stop_token stop, Work work) {
  for (bool again = false;; again = true) {
    SCAN_CHECK(EnsureOpen(stop));
    Result<T> result = work();
    if (result || again || !camera_->broken() || stop.stop_requested()) return result;
  }
}

Result<AppliedSettings> PtpCamera::Configure(const CameraSettings& settings) {
  CameraSettings wish = asked_;
  if (settings.exposure_us) wish.exposure_us = settings.exposure_us;
  if (settings.gain) wish.gain = settings.gain;
  return WithRecovery<AppliedSettings>({}, [&] { return ConfigureOnce(wish); });
}

Result<PtpCamera::Shot> PtpCamera::Release(std::stop_token stop) {
  Shot shot;
  if (lines_ && lines_->has_release()) {
    shot.released_ns = Now();
    unsettled_ = true;
    SCAN_CHECK(lines_->Press(true));
    const bool waited = clock_->SleepFor(NsOfMs(options_.config.release_ms), stop);
    SCAN_CHECK(lines_->Press(false));
    if (!waited) return Cancelled(where_);
    return shot;
  }
  const bool trigger = camera_->Abilities().trigger;
  const std::int64_t deadline_ns = Now() + NsOfMs(options_.config.picture_ms);
  for (;;) {
    shot.released_ns = Now();
    unsettled_ = true;
    PhotoStatus released;
    if (trigger) {
      released = camera_->Trigger();
    } else if (auto file = camera_->Capture()) {
      shot.first_file_ns = Now();
      shot.files.push_back(std::move(*file));
    } else {
      released = tl::unexpected(file.error());
    }
    if (released) return shot;
    if (released.error().kind != PhotoFaultKind::busy || Now() >= deadline_ns)
      return Fault(released.error());
    if (stop.stop_requested()) return Cancelled(where_);
    if (const auto pumped = Pump(kWaitMs); !pumped) return Fault(pumped.error());
  }
}

Status PtpCamera::Collect(Shot& shot, const AppliedSettings& applied, std::stop_token stop) {
  const auto wanted = static_cast<std::size_t>(settings_->files_per_exposure());
  const double exposure_ms = 1e-3 * applied.exposure_us.value_or(0);
  given_up_end_ns_ = shot.released_ns + NsOfMs(exposure_ms);
  const std::int64_t earliest_ns = shot.released_ns + NsOfMs(kLeastExposure * exposure_ms);
  if (shot.first_file_ns > 0 && shot.first_file_ns < earliest_ns)
    return DeviceFault(shot.files.front().name + " came before the exposure can have ended", where_,
                       "nobody else may release the camera");
  std::int64_t deadline_ns =
      shot.first_file_ns > 0 ? shot.first_file_ns + NsOfMs(options_.config.pair_ms)
                             : shot.released_ns + NsOfMs(options_.config.picture_ms + exposure_ms);
  for (int k = 0; k < kMaxEvents;) {
    // All that are wanted: what comes now belongs to another exposure, and who knows which did not.
    const bool complete = shot.files.size() >= wanted;
    const std::int64_t left_ms = (deadline_ns - Now()) / 1'000'000;
    if (!complete && left_ms <= 0) break;
    if (stop.stop_requested()) return Cancelled(where_);
    const auto event = camera_->WaitEvent(
        complete ? kSurplusMs : static_cast<int>(std::min<std::int64_t>(left_ms, kWaitMs)));
    if (!event && event.error().kind != PhotoFaultKind::busy) return Fault(event.error());
    if (!event || event->kind == PhotoEventKind::none) {
      if (complete) return {};
      if (shot.files.size() == 1 && !camera_->Abilities().trigger) FindPartners(shot);
      continue;
    }
    ++k;
    if (event->kind != PhotoEventKind::file_added ||
        std::find(shot.files.begin(), shot.files.end(), event->file) != shot.files.end())
      continue;
    if (Now() < earliest_ns) {
      if (const auto handled = HandleStale(*event); !handled) return Fault(handled.error());
      continue;
    }
    if (shot.files.empty()) {
      shot.first_file_ns = Now();
      deadline_ns = shot.first_file_ns + NsOfMs(options_.config.pair_ms);
    }
    shot.files.push_back(event->file);
    if (shot.files.size() > wanted)
      return DeviceFault(
          fmt::format("{} files came where one exposure gives {}", shot.files.size(), wanted),
          where_,
          "nobody else may release the camera; camera.ptp.files says how many "
          "there are");
  }
  return DeviceFault(
      fmt::format("{} of {} files came after the release", shot.files.size(), wanted), where_,
      "look at the camera's display; camera.ptp.picture_ms and pair_ms are the times waited");
}

// A capture that names one file says nothing of its partner.
void PtpCamera::FindPartners(Shot& shot) {
  const PhotoFile first = shot.files.front();
  const auto names = camera_->FilesIn(first.folder);
  if (!names) return;
  const std::string stem = first.name.substr(0, first.name.rfind('.') + 1);
  for (const std::string& name : *names) {
    if (name != first.name && name.starts_with(stem)) shot.files.push_back({first.folder, name});
  }
}

Result<ExposureBound> PtpCamera::BoundOf(const Shot& shot, const AppliedSettings& applied) {
  const ExposureBound seen{shot.released_ns, shot.first_file_ns, ExposureSource::ptp_bound};
  if (!lines_ || !lines_->has_hot_shoe()) return seen;
  SCAN_TRY(const std::vector<std::int64_t> closed_ns, lines_->TakeHotShoe());
  if (closed_ns.size() != 1 || closed_ns.front() < shot.released_ns)
    return DeviceFault(
        fmt::format("the flash contact closed {} times for one exposure", closed_ns.size()), where_,
        "check its cable; the camera must not be set to silent or bracketing");
  const std::int64_t curtain_ns = NsOfMs(options_.config.curtain_ms);
  const std::int64_t exposure_ns = std::llround(1e3 * applied.exposure_us.value_or(0));
  if (exposure_ns == 0) return seen;  // its end is not known
  return ExposureBound{std::max(seen.not_before_ns, closed_ns.front() - curtain_ns),
                       std::min(seen.not_after_ns, closed_ns.front() + exposure_ns + curtain_ns),
                       ExposureSource::hot_shoe};
}

void PtpCamera::Remove(const PhotoFile& file) {
  if (!camera_->Abilities().deletes || !camera_->Delete(file)) ++counters_.undeleted;
}

Result<Frame> PtpCamera::Fetch(const Shot& shot) {
  Frame frame;
  for (const PhotoFile& file : shot.files) {
    SCAN_TRY(std::string extension, PictureExtension(file, where_));
    auto bytes = camera_->Download(file);
    if (!bytes) return Fault(bytes.error());
    frame.files.push_back({std::move(extension), std::move(*bytes)});
    SCAN_CHECK(CheckPicture(frame.files.back(), options_.w, options_.h, where_ + ", " + file.name));
  }
  // The picture that every program reads comes first.
  std::stable_partition(frame.files.begin(), frame.files.end(),
                        [](const EncodedFile& file) { return file.extension == "jpg"; });
  return frame;
}

Result<Frame> PtpCamera::Develop(const Shot& shot, const AppliedSettings& applied) {
  SCAN_CHECK(CheckOneExposure(shot.files, where_));
  SCAN_TRY(const ExposureBound exposure, BoundOf(shot, applied));
  SCAN_TRY(const AppliedSettings after, settings_->Read(*camera_));
  if (after != applied)
    return DeviceFault("exposure or ISO speed changed while the picture was taken", where_,
                       "nobody may turn the camera's dials; switch its automatics off");
  SCAN_TRY(Frame frame, Fetch(shot));
  frame.exposure = exposure;
  frame.applied = applied;
  frame.sensor_sequence = ++sequence_;
  return frame;
}

Result<Frame> PtpCamera::GrabOnce(std::stop_token stop) {
  SCAN_CHECK(Drain(stop));
  SCAN_TRY(const AppliedSettings applied, Hold());
  if (lines_ && lines_->has_hot_shoe()) {
    // Somebody pressed the camera's own button: his files are waited for.
    SCAN_TRY(const auto closed_ns, lines_->TakeHotShoe());
    unsettled_ = unsettled_ || !closed_ns.empty();
  }
  SCAN_CHECK(Drain(stop));
  SCAN_TRY(Shot shot, Release(stop));
  const Status collected = Collect(shot, applied, stop);
  Result<Frame> frame = collected ? Develop(shot, applied) : tl::unexpected(collected.error());
  // The camera's memory keeps nothing; its card keeps what has not arrived here.
  if (!camera_->broken() &&
      (settings_->into_ram() || (frame && options_.config.delete_from_card))) {
    for (const PhotoFile& file : shot.files) Remove(file);
  }
  if (!frame) return frame;
  unsettled_ = false;
  ++counters_.frames;
  return frame;
}

Result<Frame> PtpCamera::Grab(std::stop_token stop) {
  if (stop.stop_requested()) return Cancelled("camera " + options_.id);
  return WithRecovery<Frame>(stop, [&] { return GrabOnce(stop); });
}

}  // namespace scan
