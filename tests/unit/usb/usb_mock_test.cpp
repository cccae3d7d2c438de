// libusb's own code against a mocked kernel: ports, serial numbers, transfers, and a whole motion
// on two simulated Tic boards behind it.
#include "tests/unit/usb/usb_mock.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "drivers/motion/tic/sim_tic.h"
#include "drivers/motion/tic/tic_motion.h"
#include "drivers/usb/libusb_bus.h"

namespace scan {
namespace {

using ::testing::HasSubstr;

UsbIdentity Board(const std::string& port, int address, const std::string& serial) {
  return {kPololuVendor, 0x00b3, 0x0107, port, serial, "Tic T825", 1, address};
}

struct Boards {
  Boards() {
    SimTic::Options options;
    options.clock = clock;
    options.settings.reverse_limit_pins = 1;
    options.reverse_edge = 0;
    options.start = 60;
    turntable = std::make_shared<SimTic>(options);
    lift = std::make_shared<SimTic>(options);
    mock.Plug(Board("1-2.3", 5, "SAME"), turntable);
    mock.Plug(Board("1-2.4", 6, "SAME"), lift);
    auto made = MakeLibusbBus();
    EXPECT_TRUE(made);
    bus = std::move(*made);
  }
  std::shared_ptr<Clock> clock = std::make_shared<SystemClock>();
  std::shared_ptr<SimTic> turntable, lift;
  UsbMock mock;
  std::shared_ptr<UsbBus> bus;
};

TEST(LibusbOnMock, ListsPortsThroughHubsAndSerialNumbers) {
  Boards boards;
  const auto list = boards.bus->List();
  ASSERT_TRUE(list) << ToString(list.error());
  EXPECT_THAT(*list,
              ::testing::IsSupersetOf({Board("1-2.3", 5, "SAME"), Board("1-2.4", 6, "SAME")}));
  EXPECT_EQ(list->size(), 4U) << "and two hubs";
}

TEST(LibusbOnMock, TransfersReachTheBoardOfThatPort) {
  Boards boards;
  TicBoard lift(boards.bus, {"SAME", "1-2.4", 0});
  TicBoard either(boards.bus, {"SAME", "", 0});
  EXPECT_EQ(either.Open().error().kind, ErrorKind::bad_input) << "two equal boards";
  ASSERT_TRUE(lift.Send(TicCommand::halt_and_set_position, -123'456));
  const auto variables = lift.ReadVariables();
  ASSERT_TRUE(variables) << ToString(variables.error());
  EXPECT_EQ(variables->position, -123'456);
  EXPECT_EQ(variables->vin_mv, 12'000);
  const auto settings = lift.ReadSettings();
  ASSERT_TRUE(settings);
  EXPECT_EQ(settings->reverse_limit_pins, 1);
  EXPECT_EQ(boards.turntable->place(), 60) << "the other one has heard nothing";
}

TEST(LibusbOnMock, TheKernelsErrorsSayHowToMendThem) {
  const struct {
    int number;
    const char* mend;
  } cases[] = {{EPIPE, "does not know this request"}, {ENODEV, "unplugged"}, {EPROTO, "cable"}};
  for (const auto& one : cases) {
    Boards boards;
    TicBoard lift(boards.bus, {"", "1-2.4", 0});
    ASSERT_TRUE(lift.ReadVariables());
    boards.mock.FailWith("1-2.4", one.number);
    const auto failed = lift.ReadVariables();
    ASSERT_FALSE(failed) << one.number;
    EXPECT_EQ(failed.error().kind, ErrorKind::device);
    EXPECT_THAT(failed.error().mend, HasSubstr(one.mend));
    EXPECT_THAT(failed.error().where, HasSubstr("1-2.4"));
    boards.mock.FailWith("1-2.4", 0);
    EXPECT_TRUE(lift.ReadVariables()) << "opened again";
  }
}

TEST(LibusbOnMock, AWatchTellsWhatComesAndGoesAndWhoItWas) {
  Boards boards;
  std::mutex mutex;
  std::vector<std::string> told;
  const auto watch = boards.bus->Watch([&](const UsbEvent& event) {
    std::lock_guard lock(mutex);
    if (event.identity.vendor != kPololuVendor) return;
    told.push_back((event.arrived ? "+" : "-") + event.identity.port + " " + event.identity.serial);
  });
  ASSERT_TRUE(watch) << ToString(watch.error());
  SystemClock clock;
  const auto wait_for = [&](std::size_t count) {
    for (int k = 0; k < 5000; ++k) {
      {
        std::lock_guard lock(mutex);
        if (told.size() >= count) return;
      }
      clock.SleepFor(1'000'000);
    }
  };
  wait_for(2);
  boards.mock.Unplug("1-2.4");
  wait_for(3);
  boards.mock.Plug(Board("1-2.4", 7, "NEW"), boards.lift);
  wait_for(4);
  std::lock_guard lock(mutex);
  ASSERT_EQ(told.size(), 4U);
  std::sort(told.begin(), told.begin() + 2);
  EXPECT_THAT(told,
              ::testing::ElementsAre("+1-2.3 SAME", "+1-2.4 SAME", "-1-2.4 SAME", "+1-2.4 NEW"));
}

TEST(LibusbOnMock, AWholeMotion) {
  Boards boards;
  TicMotionParts parts;
  AxisConfig axis;
  axis.steps_per_unit = 40;
  axis.velocity = 100;
  axis.acceleration = 1000;
  axis.self_start = 10;
  axis.homing = {HomingKind::endstop, -1, 0, 50, 10, 1, 20};
  parts.turntable = parts.lift = axis;
  parts.turntable.name = "turntable";
  parts.lift.name = "lift";
  parts.tic.turntable.port = "1-2.3";
  parts.tic.lift.port = "1-2.4";
  parts.aim_ids = {"a0"};
  const auto motion = MakeTicMotion(parts, boards.bus, boards.clock);
  ASSERT_TRUE(motion) << ToString(motion.error());
  const auto homed = (*motion)->Home({});
  ASSERT_TRUE(homed) << ToString(homed.error());
  const auto moved = (*motion)->MoveTo({7.5, 5, "a0"}, {});
  ASSERT_TRUE(moved) << ToString(moved.error());
  EXPECT_EQ(boards.turntable->place(), 300 + 1);
  EXPECT_EQ(boards.lift->place(), 200 + 1);
  boards.mock.FailWith("1-2.3", ENODEV);
  EXPECT_FALSE((*motion)->MoveTo({0, 0, "a0"}, {}));
  EXPECT_EQ((*motion)->ReadStatus().turntable, AxisState::fault);
  boards.mock.FailWith("1-2.3", 0);
  EXPECT_TRUE((*motion)->Home({}));
}

}  // namespace
}  // namespace scan

int main(int argc, char** argv) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  std::puts("skipped: a sanitizer and umockdev both want to be loaded first");
  return 0;
#endif
  const char* loaded = std::getenv("LD_PRELOAD");
  if (!loaded || std::string_view(loaded).find("umockdev") == std::string_view::npos) {
    std::vector<char*> arguments{const_cast<char*>("umockdev-wrapper")};
    arguments.insert(arguments.end(), argv, argv + argc);
    arguments.push_back(nullptr);
    execvp(arguments.front(), arguments.data());
    std::puts("skipped: umockdev-wrapper is not here");
    return 0;
  }
  testing::InitGoogleMock(&argc, argv);
  return RUN_ALL_TESTS();
}
