// Turntable and lift on Tic boards, as one Motion.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "drivers/base/clock.h"
#include "drivers/motion/axis_config.h"
#include "drivers/motion/interlocks.h"
#include "drivers/motion/motion.h"
#include "drivers/motion/tic/tic_axis.h"
#include "drivers/motion/tic/tic_config.h"
#include "drivers/usb/usb_bus.h"

namespace scan {

struct TicMotionParts {
  AxisConfig turntable, lift;
  TicMotionConfig tic;
  std::vector<std::string> aim_ids;  // known by name; the camera is aimed by hand or not at all
};

// The boards make the ramps; this thread asks them where they are until they have arrived. A board
// that is not spoken to for a second ramps down by itself.
class TicMotion final : public Motion {
 public:
  // Opens both boards and takes the current away. Errors: device; bad_input for two axes on one
  // board.
  static Result<std::unique_ptr<TicMotion>> Make(const TicMotionParts& parts,
                                                 std::shared_ptr<UsbBus> bus,
                                                 std::shared_ptr<Clock> clock);
  ~TicMotion() override;

  Result<HomeReport> Home(std::stop_token stop) override;
  Result<MoveReport> MoveTo(const StageTarget& target, std::stop_token stop) override;
  Status Stop() override;
  Status Abort() override;
  // As StepperMotion: from any thread, also while a move runs.
  void SetInterlock(Interlock interlock, bool present);
  Status LoseHeartbeat() override;
  Status Acknowledge() override;
  MotionStatus ReadStatus() override;

  // Speaks to boards at rest: keeps them from their command timeout, notices a pressed kill switch
  // and a lost board. From any thread.
  void KeepAlive();
  // Calls KeepAlive() on a thread of its own from now on.
  void StartKeepAlive();

 private:
  enum class Outcome { finished, stopped, aborted, power_cut };

  TicMotion(const TicMotionParts& parts, std::shared_ptr<UsbBus> bus, std::shared_ptr<Clock> clock);
  void Begin();
  Status EndLocked();
  Result<Outcome> Play();
  Status PollAll(std::int64_t now_ns);
  Status Homing();
  Status CheckTarget(const StageTarget& target) const;
  Result<MoveReport> Moving(const StageTarget& target);
  void KeepAliveLocked();
  void SetInterlockLocked(Interlock interlock, bool present);
  void WatchKillSwitch();
  void AbortAll();
  void CutAll();
  Error EndError(Outcome outcome) const;
  StagePosition Position() const;

  std::shared_ptr<Clock> clock_;
  std::vector<std::string> aim_ids_;
  std::int64_t poll_ns_;
  std::mutex mutex_;  // guards all below
  TicAxis turntable_, lift_;
  std::array<TicAxis*, 2> axes_{&lift_, &turntable_};  // in the order of homing
  std::stop_source wake_;
  bool stop_requested_ = false, abort_requested_ = false, cut_requested_ = false;
  std::optional<Interlock> stopped_by_;
  Interlocks interlocks_;
  bool kill_switch_pressed_ = false;
  bool running_ = false;
  int reference_epoch_ = 0;
  std::int64_t settled_mono_ns_ = 0;
  std::jthread keep_alive_;  // last: it uses all of the above
};

// Ready for use, with its keep-alive thread.
Result<std::unique_ptr<Motion>> MakeTicMotion(const TicMotionParts& parts,
                                              std::shared_ptr<UsbBus> bus,
                                              std::shared_ptr<Clock> clock);

}  // namespace scan
