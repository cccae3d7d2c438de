#include "drivers/motion/real_time_motion.h"

#include <optional>

namespace scan {

RealTimeMotion::RealTimeMotion(std::unique_ptr<Motion> inner, const RealTimeOptions& options,
                               std::function<void(const RealTimeGrant&)> on_ready)
    : inner_(std::move(inner)),
      thread_([this, options, on_ready = std::move(on_ready)](std::stop_token stop) {
        const RealTimeGrant grant = BecomeRealTime(options);
        if (on_ready) on_ready(grant);
        Run(stop);
      }) {}

RealTimeMotion::~RealTimeMotion() { (void)inner_->Stop(); }

void RealTimeMotion::Run(std::stop_token stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return job_ != nullptr; })) {
    const std::function<void()>& job = *job_;
    lock.unlock();
    job();
    lock.lock();
    job_ = nullptr;
    changed_.notify_all();
  }
}

void RealTimeMotion::Do(const std::function<void()>& job) {
  std::unique_lock lock(mutex_);
  job_ = &job;
  changed_.notify_all();
  changed_.wait(lock, [&] { return job_ != &job; });
}

Result<HomeReport> RealTimeMotion::Home(std::stop_token stop) {
  std::optional<Result<HomeReport>> result;
  Do([&] { result = inner_->Home(stop); });
  return *std::move(result);
}

Result<MoveReport> RealTimeMotion::MoveTo(const StageTarget& target, std::stop_token stop) {
  std::optional<Result<MoveReport>> result;
  Do([&] { result = inner_->MoveTo(target, stop); });
  return *std::move(result);
}

}  // namespace scan
