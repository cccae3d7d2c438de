#include "firmware-host/daemon/capture_service.h"

#include "drivers/base/log.h"
#include "firmware-host/protocol/motion_messages.h"
#include "firmware-host/protocol/rpc.h"

namespace scan {

class CaptureService::Observer final : public CaptureObserver {
 public:
  explicit Observer(CaptureService& service) : service_(service) {}
  void OnProgress(const CaptureProgress& progress) override {
    const std::lock_guard lock(service_.mutex_);
    service_.progress_ = progress;
  }

 private:
  CaptureService& service_;
};

CaptureService::~CaptureService() {
  Stop();
  if (thread_.joinable()) thread_.join();
}

Status CaptureService::Start(CaptureRequest request) {
  const std::lock_guard lock(mutex_);
  if (control_)
    return BadInput("a capture is running", session_.string(),
                    "wait for it, or stop it with: scanstation stop");
  if (thread_.joinable()) thread_.join();  // of a capture that has ended
  control_ = std::make_shared<CaptureControl>();
  session_ = request.folder;
  progress_ = {};
  last_.reset();
  Log(LogLevel::info, "capture_start", {{"session", session_.string()}});
  thread_ = std::thread([this, request = std::move(request), control = control_]() mutable {
    Run(std::move(request), std::move(control));
  });
  return {};
}

void CaptureService::Run(CaptureRequest request, std::shared_ptr<CaptureControl> control) {
  Observer observer(*this);
  auto report = RunCapture(station_, request, *control, &observer);
  Log(report ? LogLevel::info : LogLevel::error, "capture_end",
      {{"session", request.folder.string()},
       {"outcome", report ? std::string(NameOf(report->outcome)) : ToString(report.error())}});
  const std::lock_guard lock(mutex_);
  last_ = std::move(report);
  control_.reset();
}

void CaptureService::Stop() {
  std::shared_ptr<CaptureControl> control;
  {
    const std::lock_guard lock(mutex_);
    control = control_;
  }
  if (control) control->Cancel();
  (void)station_.motion->Stop();
}

Status CaptureService::Pause() {
  const std::lock_guard lock(mutex_);
  if (!control_) return BadInput("no capture is running", "pause", "start one first");
  control_->Pause();
  return {};
}

Status CaptureService::Resume() {
  const std::lock_guard lock(mutex_);
  if (!control_) return BadInput("no capture is running", "resume", "start one first");
  control_->Resume();
  return {};
}

nlohmann::json CaptureService::ReadStatus() {
  const auto question = operator_prompt_.Question();
  const MotionStatus motion = station_.motion->ReadStatus();
  const std::lock_guard lock(mutex_);
  std::string state = "idle";
  if (control_)
    state = control_->cancelled() ? "stopping" : control_->paused() ? "paused" : "capturing";
  nlohmann::json status = {{"state", state},
                           {"session", session_.string()},
                           {"activity", control_ ? std::string(NameOf(progress_.state)) : ""},
                           {"view", progress_.view},
                           {"views_accepted", progress_.views_accepted},
                           {"views_failed", progress_.views_failed},
                           {"view_count", progress_.view_count},
                           {"message", progress_.message},
                           {"last_picture", progress_.last_picture.string()},
                           {"question", question ? NameOf(*question) : ""},
                           {"motion", ToJson(motion)},
                           {"failed", nlohmann::json::array()}};
  if (!last_) return status;
  if (!*last_) {
    status["outcome"] = "error";
    status["error"] = ErrorToJson(last_->error());
    status["message"] = ToString(last_->error());
    return status;
  }
  const CaptureReport& report = **last_;
  status["outcome"] = std::string(NameOf(report.outcome));
  status["views_accepted"] = report.views_accepted;
  status["view_count"] = report.view_count;
  status["frames_rejected"] = report.frames_rejected;
  for (const FailedView& failed : report.failed)
    status["failed"].push_back({{"view", failed.view}, {"reason", failed.reason}});
  if (report.fault) {
    status["error"] = ErrorToJson(*report.fault);
    status["message"] = ToString(*report.fault);
  }
  return status;
}

std::filesystem::path CaptureService::LastPicture() {
  const std::lock_guard lock(mutex_);
  return progress_.last_picture;
}

}  // namespace scan
