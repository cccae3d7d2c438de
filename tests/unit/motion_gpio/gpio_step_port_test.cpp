#include "drivers/motion/gpio/gpio_step_port.h"

#include <gtest/gtest.h>

#include "drivers/base/virtual_clock.h"
#include "drivers/io/gpio/sim_gpio_board.h"

namespace scan {
namespace {

enum PortLine : unsigned { kStep, kDir, kEn, kBrake, kStop };

struct Event {
  unsigned line;
  bool high;
  std::int64_t ns;
};

struct PortBench {
  PortBench() {
    board->Listen([this](unsigned line, bool high) {
      events.push_back({line, high, clock->Now().mono_ns});
    });
    wiring.step = {"STEP"};
    wiring.direction = {"DIR"};
    wiring.enable = {"EN", true};
    wiring.brake = {"BRAKE"};
    wiring.endstop = {"STOP"};
    wiring.pulse_us = 3;
    wiring.setup_us = 20;
    auto started = InputWatch::Start(board->Opener(), "board", {{"endstop", wiring.endstop}});
    EXPECT_TRUE(started);
    watch = std::move(*started);
    auto opened =
        GpioStepPort::Open(board->Opener(), "board", "lift", wiring, {watch, 0, {}}, clock);
    EXPECT_TRUE(opened) << ToString(opened.error());
    port = std::move(*opened);
  }
  std::shared_ptr<VirtualClock> clock = std::make_shared<VirtualClock>();
  std::shared_ptr<SimGpioBoard> board = std::make_shared<SimGpioBoard>(
      "board", std::vector<std::string>{"STEP", "DIR", "EN", "BRAKE", "STOP"}, clock);
  std::vector<Event> events;
  GpioAxisWiring wiring;
  std::shared_ptr<InputWatch> watch;
  std::unique_ptr<GpioStepPort> port;
};

TEST(GpioStepPort, StartsWithoutCurrentAndBraked) {
  PortBench bench;
  EXPECT_TRUE(bench.board->Level("EN")) << "active is low";
  EXPECT_TRUE(bench.board->Level("BRAKE"));
  EXPECT_FALSE(bench.board->Level("STEP"));
}

TEST(GpioStepPort, KeepsSetUpHoldAndPulseTimes) {
  PortBench bench;
  ASSERT_TRUE(bench.port->Enable(true));
  const std::int64_t enabled_ns = bench.clock->Now().mono_ns;
  bench.events.clear();
  std::int64_t first_step_ns = 0;
  for (const bool positive : {true, true, false, true}) {
    ASSERT_TRUE(bench.port->SetDirection(positive));
    ASSERT_TRUE(bench.port->EmitEdge(0));
    ASSERT_TRUE(bench.port->EmitEdge(0));
  }
  std::int64_t direction_ns = -1'000'000, rise_ns = -1'000'000, fall_ns = -1'000'000;
  int steps = 0, changes = 0;
  for (const Event& event : bench.events) {
    if (event.line == kDir) {
      ++changes;
      EXPECT_GE(event.ns - fall_ns, 20'000) << "hold";
      direction_ns = event.ns;
    } else if (event.line == kStep && event.high) {
      ++steps;
      if (steps == 1) first_step_ns = event.ns;
      EXPECT_GE(event.ns - direction_ns, 20'000) << "set-up";
      EXPECT_GE(event.ns - fall_ns, 3'000) << "pause";
      rise_ns = event.ns;
    } else if (event.line == kStep) {
      EXPECT_GE(event.ns - rise_ns, 3'000) << "pulse";
      fall_ns = event.ns;
    }
  }
  EXPECT_EQ(steps, 8);
  EXPECT_EQ(changes, 3);
  EXPECT_GE(first_step_ns - enabled_ns, 2'000'000) << "the driver's current settles";
}

TEST(GpioStepPort, EveryFailingLineCallIsReported) {
  for (std::int64_t nth = 1;; ++nth) {
    PortBench bench;
    bench.board->FailAt(nth);
    const bool done = bench.port->Enable(true) && bench.port->Brake(false) &&
                      bench.port->SetDirection(true) && bench.port->EmitEdge(0);
    if (done) {
      EXPECT_EQ(nth, 6);  // enable, brake, direction, step up and down
      break;
    }
    const Status again = bench.port->EmitEdge(0);
    ASSERT_FALSE(again);
    EXPECT_EQ(again.error().kind, ErrorKind::device);
  }
}

TEST(GpioStepPort, AfterAFailedCallTheSafeLevelIsWrittenAnyway) {
  PortBench bench;
  bench.board->FailAt(1);
  EXPECT_FALSE(bench.port->Enable(true));  // who knows whether the line heard it
  EXPECT_FALSE(bench.port->Brake(false));
  bench.board->FailAt(0);
  bench.events.clear();
  EXPECT_TRUE(bench.port->Brake(true));
  EXPECT_TRUE(bench.port->Enable(false));
  ASSERT_EQ(bench.events.size(), 2U);
  EXPECT_EQ(bench.events[0].line, kBrake);
  EXPECT_TRUE(bench.events[0].high);
  EXPECT_EQ(bench.events[1].line, kEn);
  EXPECT_TRUE(bench.events[1].high) << "active is low";
}

TEST(GpioStepPort, ABrakeFallsInWhenThePortGoes) {
  PortBench bench;
  ASSERT_TRUE(bench.port->Enable(true));
  ASSERT_TRUE(bench.port->Brake(false));
  bench.events.clear();
  bench.port.reset();
  ASSERT_FALSE(bench.events.empty());
  EXPECT_EQ(bench.events.front().line, kBrake);
  EXPECT_TRUE(bench.events.front().high);
}

TEST(InputWatch, ASwitchThatDoesNotRestIsAFaultUntilForgiven) {
  PortBench bench;
  const auto wait = [&](auto done) {
    while (!done()) SystemClock().SleepFor(1'000'000);
  };
  EXPECT_FALSE(bench.port->Endstop().value());
  bench.board->Drive("STOP", true);
  wait([&] { return bench.port->Endstop().value_or(false); });
  for (int k = 0; k < 10; ++k) bench.board->Drive("STOP", k % 2 == 1);  // a few bounces are usual
  wait([&] { return bench.port->Endstop().value_or(false); });
  for (int k = 0; k < 10; ++k) bench.board->Drive("STOP", k % 2 == 1);
  wait([&] { return !bench.port->Endstop().has_value(); });
  EXPECT_NE(bench.port->Endstop().error().what.find("endstop changed more than"),
            std::string::npos);
  ASSERT_TRUE(bench.port->Enable(true));  // a new homing
  EXPECT_TRUE(bench.port->Endstop().value());
  EXPECT_FALSE(bench.port->Index()) << "none is wired";
}

TEST(InputWatch, ALineThatFailsIsActiveAndSaysSo) {
  PortBench bench;
  std::atomic<bool> told{false};
  bench.watch->Listen([&](std::size_t, bool active) { told = told || active; });
  bench.board->FailAt(1);
  bench.board->Drive("STOP", true);  // wakes the watch, whose reading fails
  while (bench.watch->Read(0)) SystemClock().SleepFor(1'000'000);
  while (!told) SystemClock().SleepFor(1'000'000);
  EXPECT_EQ(bench.watch->Read(0).error().kind, ErrorKind::device);
  bench.watch->Deafen();
}

}  // namespace
}  // namespace scan
