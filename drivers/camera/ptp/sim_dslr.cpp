#include "drivers/camera/ptp/sim_dslr.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/camera/ptp/photo_choices.h"

namespace scan {
namespace {

constexpr std::int64_t kCurtainNs = 3'000'000;

std::map<std::string, DslrSetting> SettingsOf(DslrKind kind) {
  const DslrSetting speeds{"1/125",
                           {"1/4000", "1/1000", "1/250", "1/125", "1/100", "1/60", "1/15", "1/2",
                            "1", "13/10", "30", "Bulb", "Time", "x 200"}};
  const DslrSetting target{"Internal RAM", {"Internal RAM", "Memory card"}};
  const DslrSetting focus{"Manual", {"Manual", "AF-S", "AF-C"}, true};
  switch (kind) {
    case DslrKind::nikon:
      return {{"shutterspeed2", speeds},
              {"shutterspeed", {"0.0080s", {"0.0002s", "0.0040s", "0.0080s", "0.0100s"}}},
              {"iso", {"100", {"64", "100", "200", "400", "1600"}}},
              {"isoauto", {"Off", {"On", "Off"}}},
              {"f-number", {"f/8", {"f/2.8", "f/5.6", "f/8", "f/11"}}},
              {"capturetarget", target},
              {"imagequality", {"JPEG Fine", {"JPEG Fine", "NEF (Raw)", "NEF+Fine"}}},
              {"expprogram", {"M", {"M", "P", "A", "S"}, true}},
              {"focusmode", focus},
              {"batterylevel", {"80%", {}, true}},
              {"availableshots", {"12", {}, true}}};
    case DslrKind::canon:
      return {{"shutterspeed", speeds},
              {"iso", {"100", {"Auto", "100", "200", "400"}}},
              {"aperture", {"8", {"2.8", "5.6", "8"}}},
              {"capturetarget", target},
              {"imageformat", {"L", {"L", "RAW", "RAW + L"}}},
              {"autoexposuremode", {"Manual", {"P", "TV", "AV", "Manual"}, true}},
              {"focusmode", focus},
              {"batterylevel", {"100%", {}, true}}};
    case DslrKind::plain:
      break;
  }
  return {{"shutterspeed", {"0.0080s", {"0.0040s", "0.0080s", "0.0100s", "0.0166s"}}},
          {"iso", {"100", {"100", "200"}}},
          {"expprogram", {"M", {"M", "P"}}}};
}

PhotoAbilities AbilitiesOf(DslrKind kind) { return {true, kind != DslrKind::plain, true, true}; }

std::vector<std::byte> RawBytes(int exposure) {
  std::vector<std::byte> bytes(4096, static_cast<std::byte>(exposure));
  const char head[] = {'I', 'I', 42, 0, 8, 0, 0, 0};
  std::transform(std::begin(head), std::end(head), bytes.begin(),
                 [](char c) { return static_cast<std::byte>(c); });
  return bytes;
}

PhotoFile FileAt(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return {slash == 0 ? "/" : path.substr(0, slash), path.substr(slash + 1)};
}

std::string PathOf(const PhotoFile& file) {
  return (file.folder == "/" ? "" : file.folder) + "/" + file.name;
}

}  // namespace

class SimDslrCamera final : public PhotoCamera {
 public:
  explicit SimDslrCamera(std::shared_ptr<SimDslr> dslr)
      : dslr_(std::move(dslr)), plugging_(dslr_->plugging_) {
    ++dslr_->open_cameras;
  }
  ~SimDslrCamera() override { --dslr_->open_cameras; }

  PhotoAbilities Abilities() override { return dslr_->abilities; }

  PhotoResult<std::vector<std::string>> SettingNames() override {
    if (auto entered = Enter("list settings"); !entered) return tl::unexpected(entered.error());
    std::vector<std::string> names;
    for (const auto& [name, setting] : dslr_->settings_) names.push_back(name);
    return names;
  }

  PhotoResult<PhotoSetting> Get(const std::string& name) override {
    if (auto entered = Enter("get"); !entered) return tl::unexpected(entered.error());
    const auto found = dslr_->settings_.find(name);
    if (found == dslr_->settings_.end())
      return tl::unexpected(PhotoFault{PhotoFaultKind::refused, "no setting " + name});
    const DslrSetting& setting = found->second;
    return PhotoSetting{name, name, setting.value, setting.choices, setting.read_only};
  }

  PhotoStatus Set(const std::string& name, const std::string& value) override {
    if (auto entered = Enter("set"); !entered) return entered;
    const auto found = dslr_->settings_.find(name);
    if (found == dslr_->settings_.end() || found->second.read_only)
      return tl::unexpected(PhotoFault{PhotoFaultKind::refused, "cannot set " + name});
    const auto stuck = dslr_->stuck.find(name);
    dslr_->pending_[name] = {dslr_->clock_->Now().mono_ns + dslr_->options_.settings_lag_ns,
                             stuck == dslr_->stuck.end() ? value : stuck->second};
    return {};
  }

  PhotoStatus Trigger() override {
    if (auto entered = Enter("trigger"); !entered) return entered;
    if (!dslr_->abilities.trigger)
      return tl::unexpected(PhotoFault{PhotoFaultKind::unsupported, "no trigger"});
    if (dslr_->busy_releases > 0) {
      --dslr_->busy_releases;
      return tl::unexpected(PhotoFault{PhotoFaultKind::busy, "the camera is busy"});
    }
    dslr_->Expose();
    return {};
  }

  // As libgphoto2 has it: the last file of the exposure, and no word of the others.
  PhotoResult<PhotoFile> Capture() override {
    if (auto entered = Enter("capture"); !entered) return tl::unexpected(entered.error());
    dslr_->Expose();
    if (dslr_->coming_.empty())
      return tl::unexpected(PhotoFault{PhotoFaultKind::refused, "no file came"});
    dslr_->clock_->SleepUntil(dslr_->coming_.back().at_ns);
    dslr_->Advance();
    const PhotoFile file = dslr_->events_.back().file;
    dslr_->events_.clear();
    return file;
  }

  PhotoResult<PhotoEvent> WaitEvent(int timeout_ms) override {
    if (auto entered = Enter("wait for event"); !entered) return tl::unexpected(entered.error());
    const std::int64_t end_ns = dslr_->clock_->Now().mono_ns + 1'000'000LL * timeout_ms;
    if (dslr_->events_.empty()) {
      std::int64_t next_ns = end_ns;
      for (const auto& coming : dslr_->coming_) next_ns = std::min(next_ns, coming.at_ns);
      dslr_->clock_->SleepUntil(next_ns);
      dslr_->Advance();
    }
    if (Gone()) return tl::unexpected(PhotoFault{PhotoFaultKind::gone, "the camera has gone"});
    if (dslr_->events_.empty()) return PhotoEvent{};
    PhotoEvent event = dslr_->events_.front();
    dslr_->events_.pop_front();
    return event;
  }

  PhotoResult<std::vector<std::string>> FilesIn(const std::string& folder) override {
    if (auto entered = Enter("list files"); !entered) return tl::unexpected(entered.error());
    std::vector<std::string> names;
    for (const auto& [path, bytes] : dslr_->files_) {
      if (const PhotoFile file = FileAt(path); file.folder == folder) names.push_back(file.name);
    }
    return names;
  }

  PhotoResult<std::vector<std::byte>> Download(const PhotoFile& file) override {
    if (auto entered = Enter("download"); !entered) return tl::unexpected(entered.error());
    const auto found = dslr_->files_.find(PathOf(file));
    if (found == dslr_->files_.end())
      return tl::unexpected(PhotoFault{PhotoFaultKind::refused, "no file " + file.name});
    return found->second;
  }

  PhotoStatus Delete(const PhotoFile& file) override {
    if (auto entered = Enter("delete"); !entered) return entered;
    if (dslr_->files_.erase(PathOf(file)) == 0)
      return tl::unexpected(PhotoFault{PhotoFaultKind::refused, "no file " + file.name});
    return {};
  }

  PhotoResult<std::vector<PhotoStorage>> Storage() override {
    if (auto entered = Enter("storage"); !entered) return tl::unexpected(entered.error());
    return dslr_->cards;
  }

 private:
  bool Gone() const { return dslr_->Gone() || plugging_ != dslr_->plugging_; }
  PhotoStatus Enter(const char* call) {
    if (auto entered = dslr_->Enter(call); !entered) return entered;
    if (Gone()) return tl::unexpected(PhotoFault{PhotoFaultKind::gone, "the camera has gone"});
    return {};
  }

  std::shared_ptr<SimDslr> dslr_;
  int plugging_;
};

class SimDslrLines final : public ShutterLines {
 public:
  explicit SimDslrLines(SimDslr& dslr) : dslr_(dslr) {}
  bool has_release() const override { return true; }
  bool has_hot_shoe() const override { return true; }
  Status Press(bool pressed) override {
    if (pressed) dslr_.Expose();
    return {};
  }
  Result<std::vector<std::int64_t>> TakeHotShoe() override {
    const std::int64_t now_ns = dslr_.clock_->Now().mono_ns;
    std::vector<std::int64_t> closed;
    while (!dslr_.hot_shoe_.empty() && dslr_.hot_shoe_.front() <= now_ns) {
      closed.push_back(dslr_.hot_shoe_.front());
      dslr_.hot_shoe_.pop_front();
    }
    return closed;
  }

 private:
  SimDslr& dslr_;
};

SimDslr::SimDslr(SimDslrOptions options, std::shared_ptr<Clock> clock)
    : abilities(AbilitiesOf(options.kind)),
      options_(std::move(options)),
      clock_(std::move(clock)),
      settings_(SettingsOf(options_.kind)) {}

std::unique_ptr<ShutterLines> SimDslr::Lines() { return std::make_unique<SimDslrLines>(*this); }

PhotoResult<std::vector<PhotoDevice>> SimDslr::List() {
  if (Gone()) return std::vector<PhotoDevice>();
  return std::vector<PhotoDevice>{options_.device};
}

PhotoResult<std::unique_ptr<PhotoCamera>> SimDslr::Open(const PhotoDevice& device) {
  if (open_fault) return tl::unexpected(PhotoFault{*open_fault, "the camera cannot be opened"});
  if (Gone() || device != options_.device)
    return tl::unexpected(PhotoFault{PhotoFaultKind::gone, "the camera has gone"});
  return std::make_unique<SimDslrCamera>(shared_from_this());
}

std::vector<std::string> SimDslr::Competitors(const PhotoDevice&) { return competitors; }

void SimDslr::PressButton() { Expose(); }

void SimDslr::Unplug(std::int64_t back_ns) {
  gone_until_ns_ = back_ns;
  ++plugging_;
  coming_.clear();
  events_.clear();
  std::erase_if(files_, [](const auto& file) { return file.first.starts_with("/capt"); });
}

bool SimDslr::Gone() const { return clock_->Now().mono_ns < gone_until_ns_; }

PhotoStatus SimDslr::Enter(const char* call) {
  ++calls;
  if (calls == slow_at) clock_->SleepFor(slow_ns);
  Advance();
  if (fail_at > 0 && calls >= fail_at && calls < fail_at + fail_count) {
    if (fail_unplugs) Unplug(clock_->Now().mono_ns + 1'000'000'000);
    return tl::unexpected(PhotoFault{fail_kind, fmt::format("{} failed", call)});
  }
  return {};
}

void SimDslr::Expose() {
  Advance();
  const auto speed =
      settings_.find(settings_.contains("shutterspeed2") ? "shutterspeed2" : "shutterspeed");
  const double exposure_us =
      speed == settings_.end() ? 8000 : ExposureUsOf(speed->second.value).value_or(8000);
  Exposure exposure;
  exposure.begin_ns = clock_->Now().mono_ns + options_.shutter_lag_ns;
  exposure.end_ns = exposure.begin_ns + std::llround(1e3 * exposure_us);
  exposures_.push_back(exposure);
  if (on_release) on_release();
  hot_shoe_.push_back(exposure.begin_ns +
                      std::min(kCurtainNs, exposure.end_ns - exposure.begin_ns));

  const int number = static_cast<int>(exposures_.size());
  const auto quality_at =
      settings_.find(settings_.contains("imageformat") ? "imageformat" : "imagequality");
  const std::string quality = quality_at == settings_.end() ? "JPEG" : quality_at->second.value;
  const bool both = quality.find('+') != std::string::npos;
  const bool raw = both || quality.starts_with("RAW") || quality.starts_with("NEF");
  const auto target = settings_.find("capturetarget");
  const bool in_memory = target != settings_.end() && target->second.value == "Internal RAM";
  const bool nikon = options_.kind == DslrKind::nikon;
  std::int64_t at_ns = exposure.end_ns + options_.transfer_lag_ns;
  ++file_number_;
  const auto add = [&](const char* extension, std::vector<std::byte> bytes) {
    std::string path = fmt::format("/store_00010001/DCIM/100SIM/{}{:04}.{}",
                                   nikon ? "DSC_" : "IMG_", file_number_, extension);
    if (nikon && in_memory) {
      std::string lower = extension;
      for (char& c : lower) c = static_cast<char>(std::tolower(c));
      path = fmt::format("/capt{:04}.{}", file_number_++, lower);
    }
    coming_.push_back({at_ns, std::move(path), std::move(bytes)});
    at_ns += options_.pair_lag_ns;
  };
  if (raw && !loses_raw) add(nikon ? "NEF" : "CR2", RawBytes(number));
  if (raw && !both) return;
  std::vector<std::byte> jpeg = options_.jpeg ? options_.jpeg(number) : std::vector<std::byte>();
  if (cuts_jpeg) jpeg.resize(jpeg.size() / 2);
  add("JPG", std::move(jpeg));
}

// What has happened up to now.
void SimDslr::Advance() {
  const std::int64_t now_ns = clock_->Now().mono_ns;
  std::erase_if(pending_, [&](const auto& entry) {
    if (entry.second.first > now_ns) return false;
    settings_[entry.first].value = entry.second.second;
    return true;
  });
  std::stable_sort(coming_.begin(), coming_.end(),
                   [](const Coming& a, const Coming& b) { return a.at_ns < b.at_ns; });
  while (!coming_.empty() && coming_.front().at_ns <= now_ns) {
    Coming& first = coming_.front();
    events_.push_back({PhotoEventKind::other, {}, "PTP Property 5007 changed"});
    events_.push_back({PhotoEventKind::file_added, FileAt(first.name), ""});
    files_[first.name] = std::move(first.bytes);
    coming_.erase(coming_.begin());
  }
}

}  // namespace scan
