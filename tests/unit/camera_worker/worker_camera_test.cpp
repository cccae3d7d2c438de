// A camera in a process of its own, and every way in which that process can fail.
#include "firmware-host/camera_worker/worker_camera.h"

#include <dirent.h>
#include <gtest/gtest.h>

#include <thread>

#include "firmware-host/camera_worker/camera_messages.h"
#include "tests/support/temp_folder.h"
#include "tests/support/worker_bench.h"

namespace scan {
namespace {

using namespace std::chrono_literals;

constexpr double kExposureUs = 2500;

WorkerCameraOptions OptionsFor(const WorkerScript& script) {
  WorkerCameraOptions options;
  options.id = "c0";
  options.options = Written(script);
  options.limits.silence = 2000ms;  // a loaded machine takes its time to start a program
  options.limits.grab = 1000ms;
  options.limits.configure = options.limits.open = 3000ms;
  return options;
}

int OpenDescriptors() {
  int count = 0;
  DIR* folder = ::opendir("/proc/self/fd");
  while (::readdir(folder)) ++count;
  ::closedir(folder);
  return count;
}

// open, configure, grab, grab; gives the exposure of the last frame.
Result<double> UseOnce(WorkerCamera& camera) {
  SCAN_CHECK(camera.Configure({.exposure_us = kExposureUs, .gain = {}}));
  SCAN_TRY(const Frame first, camera.Grab({}));
  SCAN_TRY(const Frame frame, camera.Grab({}));
  EXPECT_GT(frame.sensor_sequence, first.sensor_sequence);
  return frame.applied.exposure_us.value_or(0);
}

// Grabs; the cancel comes while it waits for the frame.
Result<Frame> GrabAndCancel(WorkerCamera& camera) {
  std::stop_source stop;
  const std::jthread canceller([&] {
    std::this_thread::sleep_for(50ms);
    stop.request_stop();
  });
  return camera.Grab(stop.get_token());
}

TEST(WorkerCamera, RunsTheCameraOfAnotherProcess) {
  auto camera = WorkerCamera::Open(OptionsFor({}), TestWorkerProgram());
  ASSERT_TRUE(camera) << ToString(camera.error());
  EXPECT_EQ((*camera)->Info().id, "c0");
  EXPECT_EQ((*camera)->Info().w, 120);
  const auto exposure_us = UseOnce(**camera);
  ASSERT_TRUE(exposure_us) << ToString(exposure_us.error());
  EXPECT_EQ(*exposure_us, kExposureUs);
  EXPECT_EQ((*camera)->restarts(), 0);
  const auto refused = (*camera)->Configure({.exposure_us = -1, .gain = {}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
}

TEST(WorkerCamera, HasNoNetwork) {
  auto camera =
      WorkerCamera::Open(OptionsFor({.fault = "network", .at_call = 2}), TestWorkerProgram());
  ASSERT_TRUE(camera) << ToString(camera.error());
  const auto frame = (*camera)->Grab({});
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().what, "no network");
}

class EveryFault : public ::testing::TestWithParam<const char*> {};

TEST_P(EveryFault, AtTheNthCallIsRecoveredWithTheLastSettings) {
  // The slow ones only where they differ: while opening and while grabbing.
  const std::string fault = GetParam();
  const bool slow = fault == "stop" || fault == "hang";
  for (int call = 1; call <= 4; call += slow ? 2 : 1) {
    SCOPED_TRACE(call);
    const TempFolder folder;
    const std::string lives = (folder.path() / "lives").string();
    auto options =
        OptionsFor({.fault = GetParam(), .at_call = call, .lives = lives, .faulty_lives = 1});
    if (fault == "stop") options.limits.silence = 800ms;
    if (slow) options.limits.open = 2000ms;  // of its first call
    auto camera = WorkerCamera::Open(options, TestWorkerProgram());
    ASSERT_TRUE(camera) << ToString(camera.error());
    const auto exposure_us = UseOnce(**camera);
    ASSERT_TRUE(exposure_us) << ToString(exposure_us.error());
    EXPECT_EQ(*exposure_us, kExposureUs);
    // One each, where the machine is not so busy that a worker is taken for a silent one.
    EXPECT_GE((*camera)->restarts(), 1);
    EXPECT_GE(LivesIn(lives), 2);
  }
}

INSTANTIATE_TEST_SUITE_P(All, EveryFault,
                         ::testing::Values("die", "stop", "hang", "garbage", "device"),
                         [](const auto& instance) { return std::string(instance.param); });

TEST(WorkerCamera, GivesUpAfterSoManyRestartsAndResetsTheDeviceBeforeTheLast) {
  const TempFolder folder;
  const std::string lives = (folder.path() / "lives").string();
  auto options = OptionsFor({.fault = "die", .at_call = 3, .lives = lives});
  int resets = 0, lives_at_reset = 0;
  options.on_hang = [&]() -> Status {
    ++resets;
    lives_at_reset = LivesIn(lives);
    return {};
  };
  auto camera = WorkerCamera::Open(options, TestWorkerProgram());
  ASSERT_TRUE(camera) << ToString(camera.error());
  ASSERT_TRUE((*camera)->Configure({.exposure_us = kExposureUs, .gain = {}}));
  const auto frame = (*camera)->Grab({});
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().kind, ErrorKind::device);
  EXPECT_NE(frame.error().what.find("killed by signal 9"), std::string::npos) << frame.error().what;
  EXPECT_EQ(LivesIn(lives), 3);
  EXPECT_EQ(resets, 1);
  EXPECT_EQ(lives_at_reset, 2);
}

TEST(WorkerCamera, IsOpenedDifferentlyForTheFirstTimeAndAsWrittenFromThenOn) {
  const TempFolder folder;
  const auto counted = [&](const char* name) { return (folder.path() / name).string(); };
  auto options = OptionsFor({.lives = counted("later")});
  options.first_options = Written({.fault = "die", .at_call = 3, .lives = counted("first")});
  auto camera = WorkerCamera::Open(options, TestWorkerProgram());
  ASSERT_TRUE(camera) << ToString(camera.error());
  EXPECT_EQ(LivesIn(counted("later")), 0);
  const auto exposure_us = UseOnce(**camera);
  ASSERT_TRUE(exposure_us) << ToString(exposure_us.error());
  EXPECT_EQ(LivesIn(counted("first")), 1);
  EXPECT_GE(LivesIn(counted("later")), 1);
}

TEST(WorkerCamera, ACancelReachesTheWorker) {
  auto camera =
      WorkerCamera::Open(OptionsFor({.frame_interval_us = 60'000'000}), TestWorkerProgram());
  ASSERT_TRUE(camera) << ToString(camera.error());
  const auto frame = GrabAndCancel(**camera);
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().kind, ErrorKind::cancelled);
  EXPECT_TRUE((*camera)->Configure({}));
  EXPECT_EQ((*camera)->restarts(), 0);
}

TEST(WorkerCamera, ACancelThatTheWorkerIgnoresEndsTheWorker) {
  auto options = OptionsFor({.fault = "hang", .at_call = 2});
  options.limits.grab = 20s;
  options.limits.cancel = 200ms;
  auto camera = WorkerCamera::Open(options, TestWorkerProgram());
  ASSERT_TRUE(camera) << ToString(camera.error());
  const auto frame = GrabAndCancel(**camera);
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().kind, ErrorKind::cancelled);
}

TEST(WorkerCamera, LeaksNoDescriptors) {
  const auto once = [&](const char* fault) {
    auto camera =
        WorkerCamera::Open(OptionsFor({.fault = fault, .at_call = 2}), TestWorkerProgram());
    return camera ? (*camera)->Grab({}).has_value() : false;
  };
  ASSERT_TRUE(once(""));
  const int before = OpenDescriptors();
  ASSERT_TRUE(once(""));
  ASSERT_FALSE(once("die"));
  EXPECT_EQ(OpenDescriptors(), before);
}

TEST(WorkerCamera, AProgramThatIsMissingOrEndsAtOnceIsAClearFault) {
  const auto missing = WorkerCamera::Open(OptionsFor({}), WorkerProgram("/nonexistent/worker"));
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().where, "/nonexistent/worker");
  const auto ends = WorkerCamera::Open(OptionsFor({}), WorkerProgram("/bin/true"));
  ASSERT_FALSE(ends);
  EXPECT_EQ(ends.error().kind, ErrorKind::device);
  EXPECT_NE(ends.error().what.find("exited with code 0"), std::string::npos) << ends.error().what;
}

TEST(WorkerCamera, ListsTheCamerasOfItsProgram) {
  const auto cameras = ListWorkerCameras(TestWorkerProgram());
  ASSERT_TRUE(cameras) << ToString(cameras.error());
  ASSERT_EQ(cameras->size(), 1U);
  EXPECT_EQ(cameras->front(), (CameraListing{"sim", "simulated", {"120 x 80", "no cable"}}));
}

TEST(WorkerCamera, AnAnswerThatIsTooLongIsSaidAtOnce) {
  const auto cameras = ListWorkerCameras(ThreadProgram([](UniqueFd socket) {
    CameraWorkerRole role;
    role.list = []() -> Result<std::vector<CameraListing>> {
      return std::vector<CameraListing>{{"sim", "simulated", {std::string(100'000, 'x')}}};
    };
    ServeCamera(std::move(socket), role);
  }));
  ASSERT_FALSE(cameras);
  EXPECT_EQ(cameras.error().kind, ErrorKind::bad_input) << ToString(cameras.error());
}

}  // namespace
}  // namespace scan
