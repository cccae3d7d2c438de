// TMC2209 drivers on simulated lines: datagrams, set-up, and what is found after a motion.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/base/rng.h"
#include "drivers/motion/tmc2209/sim_tmc2209.h"
#include "drivers/motion/tmc2209/tmc2209_bus.h"
#include "drivers/motion/tmc2209/tmc2209_motion.h"

namespace scan {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

Tmc2209Config At(int address) {
  Tmc2209Config config;
  config.port = "/dev/line";
  config.address = address;
  return config;
}

TEST(Tmc2209Protocol, RequestsAreTheKnownOnes) {
  EXPECT_THAT(TmcReadRequest(0, TmcRegister::gconf), ElementsAre(0x05, 0x00, 0x00, 0x48));
  EXPECT_THAT(TmcReadRequest(0, TmcRegister::ioin), ElementsAre(0x05, 0x00, 0x06, 0x6f));
  const auto write = TmcWriteRequest(3, TmcRegister::ihold_irun, 0x00081f10);
  EXPECT_THAT(std::vector(write.begin(), write.begin() + 7),
              ElementsAre(0x05, 3, 0x90, 0x00, 0x08, 0x1f, 0x10));
}

TEST(Tmc2209Protocol, ADamagedReplyIsNone) {
  const auto reply = TmcReply(TmcRegister::mscnt, 0x12345678);
  EXPECT_EQ(TmcReplyValue(reply, TmcRegister::mscnt), 0x12345678U);
  EXPECT_EQ(TmcReplyValue(reply, TmcRegister::gstat), std::nullopt);
  EXPECT_EQ(TmcReplyValue(std::span(reply).first(7), TmcRegister::mscnt), std::nullopt);
  for (std::size_t bit = 0; bit < 64; ++bit) {
    auto damaged = reply;
    damaged[bit / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
    EXPECT_EQ(TmcReplyValue(damaged, TmcRegister::mscnt), std::nullopt) << bit;
  }
}

TEST(Tmc2209Protocol, CurrentsAreThoseOfTheDatasheetAndNeverAboveWhatWasAsked) {
  Tmc2209Config config;
  config.sense_mohm = 100;
  config.run_ma = 1915;  // the table of section 9 gives 1.92 A at full scale
  EXPECT_EQ(TmcCurrentsOf(config)->run, 31);
  EXPECT_FALSE(TmcCurrentsOf(config)->low_range);
  config.run_ma = 1060;  // and 1.06 A in the lower range
  EXPECT_EQ(TmcCurrentsOf(config)->run, 31);
  EXPECT_TRUE(TmcCurrentsOf(config)->low_range);
  config.run_ma = 2000;
  EXPECT_EQ(TmcCurrentsOf(config).error().kind, ErrorKind::bad_input);
  Rng rng(5);
  for (int k = 0; k < 1000; ++k) {
    config.run_ma = rng.Uniform(40, 1915);
    config.hold_ma = rng.Uniform(0, config.run_ma);
    const auto currents = TmcCurrentsOf(config);
    ASSERT_TRUE(currents) << config.run_ma;
    EXPECT_LE(currents->run_ma, config.run_ma * 1.001);
    EXPECT_GE(currents->run_ma, config.run_ma - 61);  // a 32nd of the range
    EXPECT_LE(currents->hold, currents->run);
  }
}

struct TmcLine : ::testing::Test {
  std::shared_ptr<SimTmc2209Line> line = std::make_shared<SimTmc2209Line>(2);
  std::shared_ptr<Tmc2209Bus> bus = Tmc2209Bus::Open(OpenerOf(line), "/dev/line").value();
};

TEST_F(TmcLine, ASetUpReachesTheRegistersOfItsDriverAlone) {
  Tmc2209Config config = At(1);
  config.microsteps = 64;
  config.stealth_chop = false;
  ASSERT_TRUE(SetUpTmc2209(*bus, config));
  EXPECT_EQ(line->Register(1, TmcRegister::chopconf) >> 24 & 15, 2U) << "256 >> 2";
  EXPECT_EQ(line->Register(1, TmcRegister::gconf), 0x1c4U);
  const TmcCurrents currents = TmcCurrentsOf(config).value();
  EXPECT_EQ(line->Register(1, TmcRegister::ihold_irun) >> 8 & 31,
            static_cast<unsigned>(currents.run));
  EXPECT_EQ(line->Register(1, TmcRegister::gstat), 0U);
  EXPECT_EQ(line->Register(1, TmcRegister::nodeconf), 0x200U);
  EXPECT_EQ(line->Register(0, TmcRegister::gconf), 0x101U) << "as after power-up";
}

TEST_F(TmcLine, OneReplyLostOrDamagedIsOvercomeWhereverItIs) {
  ASSERT_TRUE(SetUpTmc2209(*bus, At(0)));
  line->LoseReply(0);
  ASSERT_TRUE(SetUpTmc2209(*bus, At(0)));
  const std::int64_t requests = line->requests();
  for (std::int64_t n = 1; n <= requests; ++n) {
    for (const bool damaged : {false, true}) {
      line->Reset(0);
      line->LoseReply(damaged ? 0 : n);
      line->DamageReply(damaged ? n : 0);
      const auto set_up = SetUpTmc2209(*bus, At(0));
      EXPECT_TRUE(set_up) << n << " " << ToString(set_up.error());
      EXPECT_EQ(line->Register(0, TmcRegister::gconf), TmcGconf(At(0)));
    }
  }
}

TEST_F(TmcLine, SilenceAndNoiseAreToldApart) {
  line->LoseReply(1, true);
  EXPECT_THAT(bus->Read(0, TmcRegister::mscnt).error().what, HasSubstr("does not answer"));
  line->LoseReply(0);
  line->DamageReply(1, true);
  EXPECT_THAT(bus->Read(0, TmcRegister::mscnt).error().what, HasSubstr("damaged"));
  line->DamageReply(0);
  EXPECT_EQ(bus->Read(3, TmcRegister::mscnt).error().kind, ErrorKind::device) << "nobody there";
  EXPECT_TRUE(bus->Read(1, TmcRegister::mscnt));
}

TEST(TmcPty, TheKernelsSerialLineCarriesTheSame) {
  const auto line = std::make_shared<SimTmc2209Line>(2);
  const PtyTmc2209 pty(line);
  if (pty.path().empty()) GTEST_SKIP() << "no pseudo-terminals here";
  const auto bus = Tmc2209Bus::Open(OpenSerialPort, pty.path());
  ASSERT_TRUE(bus) << ToString(bus.error());
  for (const int address : {0, 1}) {
    const auto set_up = SetUpTmc2209(**bus, At(address));
    ASSERT_TRUE(set_up) << ToString(set_up.error());
  }
  for (int k = 0; k < 5; ++k) line->Step(1, true);
  EXPECT_EQ(ReadTmc2209(**bus, 1)->mscnt, 5 * 16);
  EXPECT_EQ(ReadTmc2209(**bus, 0)->mscnt, 0);
}

TEST(SerialPort, WhatIsNoneIsRefused) {
  EXPECT_EQ(OpenSerialPort("/nonexistent/tty").error().kind, ErrorKind::device);
  EXPECT_THAT(OpenSerialPort("/dev/null").error().what, HasSubstr("no serial line"));
}

// Motors whose STEP pins are reached, but for some pulses.
class PulsePort final : public StepPort {
 public:
  struct Wire {
    std::shared_ptr<SimTmc2209Line> line;
    bool reversed = false;
    std::int64_t lose = 0;
  };
  PulsePort(Wire& wire, int address) : wire_(wire), address_(address) {}
  Status Enable(bool) override { return {}; }
  Status Brake(bool) override { return {}; }
  Status SetDirection(bool positive) override {
    positive_ = positive;
    return {};
  }
  Status EmitEdge(std::int64_t) override {
    if (wire_.lose > 0) {
      --wire_.lose;
    } else {
      wire_.line->Step(address_, positive_ != wire_.reversed);
    }
    return {};
  }
  Result<bool> Endstop() override { return false; }
  Result<bool> Index() override { return false; }

 private:
  Wire& wire_;
  int address_;
  bool positive_ = true;
};

// Moves both axes one step a unit.
class UnitMotion final : public Motion {
 public:
  UnitMotion(std::unique_ptr<StepPort> turntable, std::unique_ptr<StepPort> lift,
             std::function<void()> on_home)
      : turntable_(std::move(turntable)), lift_(std::move(lift)), on_home_(std::move(on_home)) {}
  Result<HomeReport> Home(std::stop_token) override {
    on_home_();
    if (refuses) return DeviceFault("interlock: cover open", "stage", "close it");
    Go(*turntable_, 7);
    aborted = false;
    return HomeReport{};
  }
  Result<MoveReport> MoveTo(const StageTarget& target, std::stop_token stop) override {
    if (aborted) return DeviceFault("not homed", "stage", "home it");
    Go(*turntable_, static_cast<int>(target.turntable_deg) - turntable_at_);
    Go(*lift_, static_cast<int>(target.lift_mm) - lift_at_);
    turntable_at_ = static_cast<int>(target.turntable_deg);
    lift_at_ = static_cast<int>(target.lift_mm);
    if (stop.stop_requested()) return Cancelled("move");
    return MoveReport{};
  }
  Status Stop() override { return {}; }
  Status Abort() override {
    aborted = true;
    return {};
  }
  MotionStatus ReadStatus() override { return {}; }
  bool aborted = false, refuses = false;

 private:
  static void Go(StepPort& port, int steps) {
    EXPECT_TRUE(port.SetDirection(steps > 0));
    for (int k = 0; k < std::abs(steps); ++k) EXPECT_TRUE(port.EmitEdge(0));
  }
  std::unique_ptr<StepPort> turntable_, lift_;
  std::function<void()> on_home_;
  int turntable_at_ = 0, lift_at_ = 0;
};

struct TmcMotion : ::testing::Test {
  void Make() {
    auto made = MakeTmc2209Motion(
        turntable_config, lift_config, OpenerOf(line), [this](const StepPortWrap& wrap) {
          auto inner = std::make_unique<UnitMotion>(
              wrap("turntable", std::make_unique<PulsePort>(turntable, 0)),
              wrap("lift", std::make_unique<PulsePort>(lift, 1)), [this] {
                sgthrs_while_homing = line->Register(0, TmcRegister::sgthrs);
                diag_while_homing = line->Register(0, TmcRegister::tcoolthrs);
              });
          unit = inner.get();
          return Result<std::unique_ptr<Motion>>(std::move(inner));
        });
    ASSERT_TRUE(made) << ToString(made.error());
    motion = std::move(*made);
  }
  std::shared_ptr<SimTmc2209Line> line = std::make_shared<SimTmc2209Line>(2);
  PulsePort::Wire turntable{line, false, 0}, lift{line, true, 0};
  Tmc2209Config turntable_config = At(0), lift_config = At(1);
  std::uint32_t sgthrs_while_homing = 0, diag_while_homing = 0;
  std::unique_ptr<Motion> motion;
  UnitMotion* unit = nullptr;
};

TEST_F(TmcMotion, CountersThatAgreeLetEveryMovePassWhateverTheirSense) {
  for (const int microsteps : {1, 8, 16, 256}) {
    turntable_config.microsteps = lift_config.microsteps = microsteps;
    Make();
    ASSERT_TRUE(motion->Home({}));
    Rng rng(7);
    for (int k = 0; k < 200; ++k) {
      const StageTarget target{std::floor(rng.Uniform(-500, 500)),
                               std::floor(rng.Uniform(-500, 500)), "a0"};
      const auto moved = motion->MoveTo(target, {});
      ASSERT_TRUE(moved) << ToString(moved.error());
    }
    EXPECT_TRUE(motion->ReadStatus().fault.empty());
  }
}

TEST_F(TmcMotion, LostPulsesAreFoundButForWholeTurnsOfTheCurrent) {
  for (std::int64_t lost = 1; lost <= 130; ++lost) {
    Make();
    ASSERT_TRUE(motion->Home({}));
    ASSERT_TRUE(motion->MoveTo({10, 10, "a0"}, {}));
    lift.lose = lost;
    const auto moved = motion->MoveTo({10, 300, "a0"}, {});
    ASSERT_EQ(moved.has_value(), lost % 64 == 0) << lost;  // 16 microsteps, 4 full steps
    if (moved) continue;
    EXPECT_EQ(moved.error().where, "lift");
    EXPECT_THAT(moved.error().what, HasSubstr("pulses were lost"));
    EXPECT_EQ(motion->ReadStatus().alarm, Alarm::invalid);
    EXPECT_TRUE(unit->aborted);
    EXPECT_FALSE(motion->MoveTo({0, 0, "a0"}, {}));
    ASSERT_TRUE(motion->Home({}));
    EXPECT_TRUE(motion->ReadStatus().fault.empty());
    ASSERT_TRUE(motion->MoveTo({0, 0, "a0"}, {}));
  }
}

TEST_F(TmcMotion, AStoppedMoveIsComparedAsWell) {
  Make();
  ASSERT_TRUE(motion->Home({}));
  ASSERT_TRUE(motion->MoveTo({10, 10, "a0"}, {}));
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(motion->MoveTo({50, 10, "a0"}, stop.get_token()).error().kind, ErrorKind::cancelled);
  turntable.lose = 3;
  EXPECT_EQ(motion->MoveTo({99, 10, "a0"}, stop.get_token()).error().kind, ErrorKind::device);
}

TEST_F(TmcMotion, ADriverThatStartsAnewIsAFaultUntilHomedAndThenSetUpAgain) {
  Make();
  ASSERT_TRUE(motion->Home({}));
  line->Reset(0);
  const auto moved = motion->MoveTo({10, 0, "a0"}, {});
  ASSERT_FALSE(moved);
  EXPECT_THAT(moved.error().what, HasSubstr("started anew"));
  EXPECT_FALSE(motion->MoveTo({10, 0, "a0"}, {}));
  ASSERT_TRUE(motion->Home({}));
  EXPECT_EQ(line->Register(0, TmcRegister::gconf), TmcGconf(turntable_config));
  EXPECT_TRUE(motion->MoveTo({20, 0, "a0"}, {}));
}

TEST_F(TmcMotion, AHomingThatIsRefusedHidesNoDriverThatHasStartedAnew) {
  Make();
  ASSERT_TRUE(motion->Home({}));
  line->Reset(0);
  unit->refuses = true;
  EXPECT_THAT(motion->Home({}).error().what, HasSubstr("cover open"));
  EXPECT_FALSE(motion->MoveTo({10, 0, "a0"}, {})) << "the position is unknown";
  unit->refuses = false;
  ASSERT_TRUE(motion->Home({}));
  EXPECT_TRUE(motion->MoveTo({10, 0, "a0"}, {}));
}

TEST_F(TmcMotion, FlagsAreFaultsOrAlarms) {
  for (const auto& [bit, words] : {std::pair(1, "overtemperature"), std::pair(2, "short circuit"),
                                   std::pair(5, "short circuit")}) {
    Make();
    ASSERT_TRUE(motion->Home({}));
    line->SetStatus(1, 1U << bit);
    const auto moved = motion->MoveTo({10, 0, "a0"}, {});
    ASSERT_FALSE(moved);
    EXPECT_THAT(moved.error().what, HasSubstr(words));
    line->SetStatus(1, 0);
  }
  Make();
  ASSERT_TRUE(motion->Home({}));
  line->SetStatus(1, 1);
  ASSERT_TRUE(motion->MoveTo({10, 0, "a0"}, {}));
  EXPECT_EQ(motion->ReadStatus().alarm, Alarm::minor);
  EXPECT_THAT(motion->ReadStatus().interlocks, HasSubstr("lift driver hot"));
  line->SetStatus(1, 0);
  ASSERT_TRUE(motion->MoveTo({11, 0, "a0"}, {}));
  EXPECT_EQ(motion->ReadStatus().alarm, Alarm::none);
}

TEST_F(TmcMotion, ASilentDriverIsAFaultAndOneReplyLostIsNot) {
  Make();
  ASSERT_TRUE(motion->Home({}));
  line->LoseReply(1, true);
  EXPECT_THAT(motion->MoveTo({10, 0, "a0"}, {}).error().what, HasSubstr("does not answer"));
  EXPECT_FALSE(motion->Home({}));
  for (std::int64_t n = 1; n <= 8; ++n) {
    line->LoseReply(0);
    ASSERT_TRUE(motion->Home({}));
    line->LoseReply(n);
    EXPECT_TRUE(motion->MoveTo({double(n), 0, "a0"}, {})) << n;
  }
}

TEST_F(TmcMotion, AStallShowsOnDiagWhileHomingOnly) {
  turntable_config.stall_threshold = 80;
  Make();
  ASSERT_TRUE(motion->Home({}));
  EXPECT_EQ(sgthrs_while_homing, 80U);
  EXPECT_EQ(diag_while_homing, 0xfffffU);
  EXPECT_EQ(line->Register(0, TmcRegister::tcoolthrs), 0U);
  EXPECT_EQ(line->Register(1, TmcRegister::sgthrs), 0U);
}

TEST_F(TmcMotion, TwoAxesOnOneAddressAreRefused) {
  const auto made = MakeTmc2209Motion(At(1), At(1), OpenerOf(line), {});
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace scan
