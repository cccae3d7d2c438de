// What the owner of a worker of libgphoto2 says to it, and asks of it.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/time.h>

#include "firmware-host/camera_worker/ptp_options.h"
#include "firmware-host/camera_worker/worker_tool.h"

namespace scan {
namespace {

TEST(PtpWorkerOptions, ArriveAsTheyWereSent) {
  PtpCameraOptions options{"c1", 8256, 5504, {}};
  PtpConfig& config = options.config;
  config.port = "1-2.3";
  config.serial = "00123";
  config.model = "Nikon DSC D850";
  config.target = "card";
  config.quality = "NEF+Fine";
  config.f_number = 11;
  config.base_iso = 64;
  config.files = 2;
  config.delete_from_card = true;
  config.manual_focus = false;
  config.min_battery_percent = 30;
  config.min_shots = 40;
  config.settings_ms = 1;
  config.picture_ms = 2;
  config.pair_ms = 3;
  config.reconnect_ms = 4;
  config.gpio_chip = "pinctrl-rp1";
  config.release_line = "RELEASE";
  config.release_active_low = true;
  config.release_ms = 5;
  config.hot_shoe_line = "SYNC";
  config.hot_shoe_active_low = false;
  config.curtain_ms = 6;
  config.settings = {{"whitebalance", "Daylight"}, {"d030", "\"1\""}};
  const auto arrived = PtpOptionsFrom(ToWorkerOptions(options));
  ASSERT_TRUE(arrived) << ToString(arrived.error());
  EXPECT_EQ(arrived->id, "c1");
  EXPECT_EQ(arrived->w, 8256);
  EXPECT_EQ(arrived->h, 5504);
  EXPECT_EQ(arrived->config, config);
}

TEST(PtpWorkerOptions, OfAnotherVersionAreRefused) {
  for (const char* text : {"", "{}", "[]", "{\"id\":1}", "no json"}) {
    const auto read = PtpOptionsFrom(text);
    ASSERT_FALSE(read) << text;
    EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
  }
}

using std::chrono::milliseconds;

TEST(WorkerTool, GivesItsAnswerOrItsError) {
  const auto answer = RunWorkerTool("/bin/echo", {R"({"ok":{"value":7}})"}, milliseconds(20'000));
  ASSERT_TRUE(answer) << ToString(answer.error());
  EXPECT_EQ(answer->value("value", 0), 7);
  const auto error = RunWorkerTool(
      "/bin/echo", {R"({"error":{"kind":"bad_input","what":"w","where":"x","mend":"m"}})"},
      milliseconds(20'000));
  ASSERT_FALSE(error);
  EXPECT_EQ(error.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(error.error().what, "w");
}

TEST(WorkerTool, WhatDiesHangsOrTalksNonsenseIsADeviceFault) {
  for (const auto& [program, words] :
       std::vector<std::pair<const char*, std::vector<std::string>>>{{"/bin/false", {}},
                                                                     {"/bin/echo", {"[1"}},
                                                                     {"/bin/echo", {"7"}},
                                                                     {"/bin/sleep", {"1000"}}}) {
    const bool hangs = std::string(program) == "/bin/sleep";
    const auto answer = RunWorkerTool(program, words, milliseconds(hangs ? 100 : 20'000));
    ASSERT_FALSE(answer) << program;
    EXPECT_EQ(answer.error().kind, ErrorKind::device) << program;
    EXPECT_EQ(answer.error().what == "the camera does not answer", hangs) << program;
  }
  const auto absent = RunWorkerTool("/nonexistent/program", {}, milliseconds(20'000));
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().kind, ErrorKind::failed);
}

TEST(WorkerTool, ASignalDoesNotMakeItWaitForEver) {
  struct sigaction heard {
  }, before{};
  heard.sa_handler = [](int) {};  // without SA_RESTART: calls that wait are interrupted
  ASSERT_EQ(sigaction(SIGALRM, &heard, &before), 0);
  const itimerval once{{0, 0}, {0, 100'000}};
  setitimer(ITIMER_REAL, &once, nullptr);
  const auto answer = RunWorkerTool("/bin/sleep", {"1000"}, milliseconds(500));
  sigaction(SIGALRM, &before, nullptr);
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().what, "the camera does not answer");
}

}  // namespace
}  // namespace scan
