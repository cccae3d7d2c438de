// The daemon's state machine: one capture at a time, seen and stopped from any thread.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>

#include "acquisition/runner/runner.h"
#include "drivers/base/result.h"
#include "drivers/station/station.h"
#include "firmware-host/daemon/operator_prompt.h"

namespace scan {

// idle -> capturing <-> paused -> stopping -> idle; the last outcome stays readable while idle.
class CaptureService {
 public:
  // Precondition: both outlive the service.
  CaptureService(Station& station, const OperatorPrompt& operator_prompt)
      : station_(station), operator_prompt_(operator_prompt) {}
  ~CaptureService();  // cancels and waits

  // Errors: bad_input while a capture runs.
  Status Start(CaptureRequest request);
  // Stops motion at once and cancels the capture; harmless when idle.
  void Stop();
  Status Pause();
  Status Resume();

  // {"state","outcome","session","views_accepted","views_failed","view_count","message",
  //  "last_picture","question":"" or "remove" or "place" (the specimen; see OperatorPrompt),
  //  "motion":{...},"failed":[{"view","reason"}]}
  nlohmann::json ReadStatus();
  std::filesystem::path LastPicture();

 private:
  class Observer;
  void Run(CaptureRequest request, std::shared_ptr<CaptureControl> control);

  Station& station_;
  const OperatorPrompt& operator_prompt_;
  std::mutex mutex_;
  std::shared_ptr<CaptureControl> control_;  // while a capture runs
  CaptureProgress progress_;
  std::filesystem::path session_;
  std::optional<Result<CaptureReport>> last_;
  std::thread thread_;
};

}  // namespace scan
