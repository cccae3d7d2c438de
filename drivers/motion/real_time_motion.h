// Runs another Motion's homings and moves on a real-time thread.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "drivers/motion/motion.h"
#include "drivers/motion/real_time.h"

namespace scan {

// Thread contract: as Motion.
class RealTimeMotion final : public Motion {
 public:
  // `on_ready` hears what the kernel granted, on the new thread.
  RealTimeMotion(std::unique_ptr<Motion> inner, const RealTimeOptions& options,
                 std::function<void(const RealTimeGrant&)> on_ready = {});
  ~RealTimeMotion() override;

  Result<HomeReport> Home(std::stop_token stop) override;
  Result<MoveReport> MoveTo(const StageTarget& target, std::stop_token stop) override;
  Status Stop() override { return inner_->Stop(); }
  Status Abort() override { return inner_->Abort(); }
  Status LoseHeartbeat() override { return inner_->LoseHeartbeat(); }
  Status Acknowledge() override { return inner_->Acknowledge(); }
  MotionStatus ReadStatus() override { return inner_->ReadStatus(); }

 private:
  void Run(std::stop_token stop);
  void Do(const std::function<void()>& job);

  std::unique_ptr<Motion> inner_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  const std::function<void()>* job_ = nullptr;
  std::jthread thread_;  // last: it uses all of the above
};

}  // namespace scan
