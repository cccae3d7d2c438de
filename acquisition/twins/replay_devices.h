// The replayed twins: devices that answer as a recorded session says.
#pragma once

#include <memory>
#include <optional>

#include "acquisition/twins/replay_script.h"
#include "drivers/station/station.h"

namespace scan {

// Clock, motion, light and every camera of the recording. What the recording does not hold is a
// device fault, never a guess; a stopped token gives cancelled.
// Thread contract: as each device.
Station MakeReplayStation(const std::shared_ptr<ReplayScript>& script);

// Stamps documents in the order of the recording; sleeping takes no time.
class ReplayClock final : public Clock {
 public:
  explicit ReplayClock(std::shared_ptr<ReplayScript> script) : script_(std::move(script)) {}
  Timestamp Now() override { return script_->Stamp(); }
  bool SleepUntil(std::int64_t, std::stop_token stop) override { return !stop.stop_requested(); }

 private:
  std::shared_ptr<ReplayScript> script_;
};

class ReplayMotion final : public Motion {
 public:
  explicit ReplayMotion(std::shared_ptr<ReplayScript> script) : script_(std::move(script)) {}
  Result<HomeReport> Home(std::stop_token stop) override;
  Result<MoveReport> MoveTo(const StageTarget& target, std::stop_token stop) override;
  Status Stop() override { return {}; }
  Status Abort() override { return {}; }
  MotionStatus ReadStatus() override;

 private:
  std::shared_ptr<ReplayScript> script_;
  std::mutex mutex_;
  MotionStatus status_;
};

class ReplayCamera final : public Camera {
 public:
  ReplayCamera(std::shared_ptr<ReplayScript> script, const CameraDocument& camera);
  const CameraInfo& Info() const override { return info_; }
  Result<AppliedSettings> Configure(const CameraSettings& settings) override;
  Result<Frame> Grab(std::stop_token stop) override;

 private:
  Status CheckAsked(const std::string& view) const;

  std::shared_ptr<ReplayScript> script_;
  CameraInfo info_;
  CameraSettings asked_;
};

class ReplayLight final : public Light {
 public:
  explicit ReplayLight(std::shared_ptr<ReplayScript> script) : script_(std::move(script)) {}
  Status Set(bool on) override;

 private:
  std::shared_ptr<ReplayScript> script_;
};

}  // namespace scan
