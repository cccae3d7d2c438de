// A camera worker for tests: the simulated camera, with a fault at the N-th call.
#pragma once

#include <signal.h>
#include <sys/socket.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>

#include "drivers/camera/sim/sim_camera.h"
#include "firmware-host/camera_worker/serve_camera.h"
#include "firmware-host/camera_worker/worker_camera.h"

namespace scan {

// What a test asks of its worker, sent as the options of `open`.
struct WorkerScript {
  std::string fault = {};  // empty: none; die stop hang garbage device network
  int at_call = 0;         // counted over open, configure and grab, from 1
  std::string lives = {};  // a file with one character a life begun; empty: not counted
  int faulty_lives = 99;   // only so many lives have the fault
  int frame_interval_us = 4000;
};

inline std::string Written(const WorkerScript& script) {
  return nlohmann::json{{"fault", script.fault},
                        {"at_call", script.at_call},
                        {"lives", script.lives},
                        {"faulty_lives", script.faulty_lives},
                        {"frame_interval_us", script.frame_interval_us}}
      .dump();
}

inline int LivesIn(const std::string& file) {
  std::error_code none;
  const auto size = std::filesystem::file_size(file, none);
  return none ? 0 : static_cast<int>(size);
}

// Counts its calls and commits the fault at the one named.
class FaultyCamera final : public Camera {
 public:
  FaultyCamera(std::unique_ptr<Camera> camera, std::string fault, int at_call)
      : camera_(std::move(camera)), fault_(std::move(fault)), at_call_(at_call) {}

  const CameraInfo& Info() const override { return camera_->Info(); }
  Result<AppliedSettings> Configure(const CameraSettings& settings) override {
    SCAN_CHECK(CommitFault());
    return camera_->Configure(settings);
  }
  Result<Frame> Grab(std::stop_token stop) override {
    SCAN_CHECK(CommitFault());
    return camera_->Grab(std::move(stop));
  }

  Status CommitFault() {
    if (++calls_ != at_call_) return {};
    if (fault_ == "die") ::raise(SIGKILL);
    if (fault_ == "stop") ::raise(SIGSTOP);
    while (fault_ == "hang") std::this_thread::sleep_for(std::chrono::milliseconds(10));
    if (fault_ == "garbage") (void)::send(kWorkerSocketFd, "\xff{no json", 9, 0);
    if (fault_ == "device") return DeviceFault("the camera is gone", "c0", "plug it in");
    if (fault_ == "network" && ::socket(AF_INET, SOCK_DGRAM, 0) < 0)
      return BadInput("no network", "c0", "as it should be");
    return {};
  }

 private:
  std::unique_ptr<Camera> camera_;
  std::string fault_;
  int at_call_;
  int calls_ = 0;
};

inline CameraWorkerRole ScriptedRole() {
  CameraWorkerRole role;
  role.open = [](const std::string& options) -> Result<std::unique_ptr<Camera>> {
    const auto json = nlohmann::json::parse(options);
    const std::string lives = json.at("lives").get<std::string>();
    if (!lives.empty()) std::ofstream(lives, std::ios::app) << 'x';
    const bool faulty = LivesIn(lives) <= json.at("faulty_lives").get<int>();
    SimCameraOptions sim;
    sim.info = {"sim", "simulated", 120, 80};
    sim.frame_interval_ns = 1000L * json.at("frame_interval_us").get<int>();
    const auto render = [](const TrueState&) -> Result<cv::Mat> {
      return cv::Mat(80, 120, CV_8UC3, cv::Scalar(60, 120, 180));
    };
    const auto state = [](std::int64_t) {
      TrueState lit;
      lit.light_on = true;
      return lit;
    };
    auto camera = std::make_unique<FaultyCamera>(
        std::make_unique<SimCamera>(sim, std::make_shared<SystemClock>(), state, render, nullptr),
        faulty ? json.at("fault").get<std::string>() : "", json.at("at_call").get<int>());
    SCAN_CHECK(camera->CommitFault());
    return camera;
  };
  role.list = []() -> Result<std::vector<CameraListing>> {
    return std::vector<CameraListing>{{"sim", "simulated", {"120 x 80", "no cable"}}};
  };
  return role;
}

// A worker that is a thread of this process: for peers that a program would not play.
class ThreadWorker final : public CameraWorker {
 public:
  ThreadWorker(UniqueFd owner, std::jthread thread)
      : owner_(std::move(owner)), thread_(std::move(thread)) {}
  UniqueFd TakeSocket() override { return std::move(owner_); }
  std::string Kill() override { return "was let go"; }

 private:
  UniqueFd owner_;
  std::jthread thread_;
};

template <class Serve>
CameraWorkerLauncher ThreadProgram(Serve serve) {
  return [serve]() -> Result<std::unique_ptr<CameraWorker>> {
    SCAN_TRY(auto sockets, WorkerSocketPair());
    std::jthread thread(serve, std::move(sockets.second));
    return std::make_unique<ThreadWorker>(std::move(sockets.first), std::move(thread));
  };
}

inline CameraWorkerLauncher TestWorkerProgram() {
  return WorkerProgram(WorkerProgramPath("camera_test_worker"));
}

}  // namespace scan
