#include "drivers/motion/axis_table.h"

#include <gtest/gtest.h>

namespace scan {
namespace {

constexpr AxisState kStates[] = {AxisState::unpowered, AxisState::unreferenced, AxisState::idle,
                                 AxisState::moving,    AxisState::held,         AxisState::fault};
constexpr AxisCommand kCommands[] = {AxisCommand::home,    AxisCommand::move,
                                     AxisCommand::stop,    AxisCommand::abort,
                                     AxisCommand::release, AxisCommand::acknowledge};
constexpr AxisEvent kEvents[] = {AxisEvent::powered, AxisEvent::released, AxisEvent::motion_started,
                                 AxisEvent::homed,   AxisEvent::arrived,  AxisEvent::stopped,
                                 AxisEvent::aborted, AxisEvent::faulted,  AxisEvent::acknowledged};
constexpr Interlock kAllInterlocks[] = {Interlock::cover_open,         Interlock::heartbeat_lost,
                                        Interlock::limit_switch,       Interlock::late_step,
                                        Interlock::emergency_stop,     Interlock::motor_power_off,
                                        Interlock::motor_power_not_cut};

TEST(AxisTable, RowsStandInTheOrderOfTheirStates) {
  static_assert(std::size(kStates) == kAxisStates && std::size(kCommands) == kAxisCommands &&
                std::size(kEvents) == kAxisEvents && std::size(kAllInterlocks) == kInterlocks);
  for (const AxisState state : kStates) EXPECT_EQ(Row(state).state, state);
  for (const Interlock interlock : kAllInterlocks) EXPECT_EQ(Row(interlock).interlock, interlock);
}

TEST(AxisTable, StopAndAbortAreAlwaysAccepted) {
  for (const AxisState state : kStates) {
    EXPECT_TRUE(Accepts(state, AxisCommand::stop)) << Row(state).name;
    EXPECT_TRUE(Accepts(state, AxisCommand::abort)) << Row(state).name;
  }
  for (const Interlock interlock : kAllInterlocks) {
    EXPECT_FALSE(Forbids(interlock, AxisCommand::stop)) << Row(interlock).name;
    EXPECT_FALSE(Forbids(interlock, AxisCommand::abort)) << Row(interlock).name;
    EXPECT_FALSE(Forbids(interlock, AxisCommand::acknowledge)) << Row(interlock).name;
  }
}

TEST(AxisTable, AMoveNeedsAKnownPositionAndRest) {
  for (const AxisState state : kStates) {
    EXPECT_EQ(Accepts(state, AxisCommand::move),
              Row(state).position_known && state != AxisState::moving)
        << Row(state).name;
    EXPECT_EQ(Accepts(state, AxisCommand::home), state != AxisState::moving) << Row(state).name;
    if (!Accepts(state, AxisCommand::move)) {
      EXPECT_FALSE(Row(state).mend.empty()) << Row(state).name;
    }
  }
}

TEST(AxisTable, OnlyHomingMakesAPositionKnown) {
  for (const AxisState state : kStates) {
    if (Row(state).position_known) continue;
    for (const AxisEvent event : kEvents) {
      const auto next = Next(state, event);
      if (!next || !Row(*next).position_known) continue;
      // `moving` counts as known: whether it is comes from the axis, which remembers.
      EXPECT_TRUE(event == AxisEvent::homed || *next == AxisState::moving)
          << Row(state).name << " " << static_cast<int>(event);
    }
  }
}

TEST(AxisTable, EveryStateHasAnAnswerToAbortFaultAndLossOfCurrent) {
  for (const AxisState state : kStates) {
    for (const AxisEvent event : {AxisEvent::aborted, AxisEvent::faulted, AxisEvent::released}) {
      const auto next = Next(state, event);
      ASSERT_TRUE(next) << Row(state).name;
      EXPECT_FALSE(Row(*next).position_known) << Row(state).name;
    }
  }
}

TEST(AxisTable, AFaultIsLeftOnlyByAcknowledging) {
  for (const AxisEvent event : kEvents) {
    const auto next = Next(AxisState::fault, event);
    if (next && *next != AxisState::fault) {
      EXPECT_EQ(event, AxisEvent::acknowledged);
    }
  }
  EXPECT_EQ(Next(AxisState::fault, AxisEvent::acknowledged), AxisState::unreferenced);
}

TEST(AxisTable, EveryInterlockForbidsMovingAndSaysHowMotionEnds) {
  for (const Interlock interlock : kAllInterlocks) {
    EXPECT_TRUE(Forbids(interlock, AxisCommand::move)) << Row(interlock).name;
    EXPECT_NE(Row(interlock).ends_motion, MotionEnd::none) << Row(interlock).name;
    EXPECT_NE(Row(interlock).alarm, Alarm::none) << Row(interlock).name;
    // Whatever may have cost the position stays up until a person has seen it.
    if (Row(interlock).alarm >= Alarm::major) {
      EXPECT_TRUE(Row(interlock).latched) << Row(interlock).name;
    }
  }
  EXPECT_TRUE(Forbids(Interlock::emergency_stop, AxisCommand::home));
}

TEST(AlarmLatch, EveryOrderOfCauseAndAcknowledgement) {
  AlarmLatch latched;
  latched.Raise(Alarm::major, true);
  latched.Acknowledge();
  EXPECT_EQ(latched.alarm(), Alarm::major);  // the cause lasts
  latched.CauseGone();
  EXPECT_EQ(latched.alarm(), Alarm::none);

  latched.Raise(Alarm::minor, true);
  latched.CauseGone();
  EXPECT_EQ(latched.alarm(), Alarm::minor);  // nobody has seen it
  latched.Raise(Alarm::invalid, true);
  latched.CauseGone();
  EXPECT_EQ(latched.alarm(), Alarm::invalid);
  latched.Acknowledge();
  EXPECT_EQ(latched.alarm(), Alarm::none);

  AlarmLatch passing;
  passing.Raise(Alarm::minor, false);
  passing.CauseGone();
  EXPECT_EQ(passing.alarm(), Alarm::none);

  AlarmLatch again;
  again.Raise(Alarm::major, true);
  again.Acknowledge();
  again.Raise(Alarm::major, true);
  again.CauseGone();
  EXPECT_EQ(again.alarm(), Alarm::major);  // the second rise was not acknowledged
}

}  // namespace
}  // namespace scan
