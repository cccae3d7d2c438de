// The tethered camera's simulated twin: a Nikon-like and a Canon-like camera, with their faults.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/base/clock.h"
#include "drivers/camera/ptp/photo_system.h"
#include "drivers/camera/ptp/shutter_lines.h"

namespace scan {

// nikon: shutterspeed2, imagequality NEF+Fine, "Internal RAM"; its names in memory are captNNNN.
// canon: shutterspeed, imageformat RAW + L, "Internal RAM", one event a property.
// plain: the PTP standard's own camera: no trigger, no capture target, tenths of milliseconds.
enum class DslrKind { nikon, canon, plain };

// A setting as the simulated camera has it.
struct DslrSetting {
  std::string value;
  std::vector<std::string> choices;
  bool read_only = false;
};

struct SimDslrOptions {
  DslrKind kind = DslrKind::nikon;
  PhotoDevice device{"Sim DSLR", "1-2.3", "00123", "04b0:0439", "usb:001,004"};
  // The JPEG of an exposure; numbered from 1.
  std::function<std::vector<std::byte>(int exposure)> jpeg;
  std::int64_t shutter_lag_ns = 60'000'000;    // from the release to the exposure
  std::int64_t transfer_lag_ns = 300'000'000;  // from its end to the first file
  std::int64_t pair_lag_ns = 150'000'000;      // to the second
  std::int64_t settings_lag_ns = 30'000'000;   // until a setting that was set is read back
};

// A bus with one camera, and the camera. Time is the clock's. Thread contract: one thread at a
// time.
class SimDslr final : public PhotoSystem, public std::enable_shared_from_this<SimDslr> {
 public:
  SimDslr(SimDslrOptions options, std::shared_ptr<Clock> clock);

  PhotoResult<std::vector<PhotoDevice>> List() override;
  // Precondition: made by std::make_shared.
  PhotoResult<std::unique_ptr<PhotoCamera>> Open(const PhotoDevice& device) override;
  std::vector<std::string> Competitors(const PhotoDevice& device) override;

  // Somebody presses the camera's own button.
  void PressButton();
  // Released by the wired contact; the flash contact's instants are `hot_shoe()`.
  std::unique_ptr<ShutterLines> Lines();
  DslrSetting& setting(const std::string& name) { return settings_[name]; }
  void RemoveSetting(const std::string& name) { settings_.erase(name); }

  std::function<void()> on_release;  // called when an exposure is released; may be empty

  // Faults.
  int calls = 0;  // of the open camera, from 1
  int fail_at = 0, fail_count = 1;
  PhotoFaultKind fail_kind = PhotoFaultKind::transfer;
  bool fail_unplugs = false;
  int slow_at = 0;  // this call takes so long
  std::int64_t slow_ns = 0;
  std::map<std::string, std::string> stuck;  // settings that keep this value, whatever is set
  int busy_releases = 0;                     // the next so many are answered with busy
  std::optional<PhotoFaultKind> open_fault;  // of every opening
  std::vector<std::string> competitors;
  bool loses_raw = false, cuts_jpeg = false;  // of every exposure
  std::vector<PhotoStorage> cards{{"CARD", true, 30'000'000, 1200}};
  PhotoAbilities abilities;
  void Unplug(std::int64_t back_ns);  // and plugged in again then

  struct Exposure {
    std::int64_t begin_ns = 0, end_ns = 0;
  };
  const std::vector<Exposure>& exposures() const { return exposures_; }
  const std::map<std::string, std::vector<std::byte>>& files() const { return files_; }
  int open_cameras = 0;

 private:
  friend class SimDslrCamera;
  friend class SimDslrLines;
  struct Coming {
    std::int64_t at_ns = 0;
    std::string name;
    std::vector<std::byte> bytes;
  };
  PhotoStatus Enter(const char* call);
  bool Gone() const;
  void Expose();
  void Advance();

  SimDslrOptions options_;
  std::shared_ptr<Clock> clock_;
  std::map<std::string, DslrSetting> settings_;
  std::map<std::string, std::pair<std::int64_t, std::string>> pending_;  // settings on their way
  std::vector<Exposure> exposures_;
  std::vector<Coming> coming_;
  std::deque<PhotoEvent> events_;
  std::map<std::string, std::vector<std::byte>> files_;  // on card or in memory, by path
  std::int64_t gone_until_ns_ = 0;
  int plugging_ = 0, file_number_ = 0;
  std::deque<std::int64_t> hot_shoe_;
};

}  // namespace scan
