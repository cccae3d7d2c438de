#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>

#include "firmware-host/protocol/motion_client.h"
#include "firmware-host/protocol/motion_messages.h"
#include "firmware-host/protocol/motion_server.h"
#include "firmware-host/protocol/socket.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

StagePosition SomePosition() {
  return {.turntable_deg = {30, 29.9, 29.95, 0.1, 0.05}, .lift_mm = {142, 142, 142.01, 0.02, 0.01}};
}

// Moves never end by themselves: only Stop, Abort or the token end them.
class EndlessMotion final : public Motion {
 public:
  Result<HomeReport> Home(std::stop_token) override { return HomeReport{3, SomePosition()}; }
  Result<MoveReport> MoveTo(const StageTarget& target, std::stop_token stop) override {
    if (target.lift_mm < 0) return BadInput("below the lower limit", "lift_mm", "stay above 0");
    std::unique_lock lock(mutex_);
    moving_ = true;
    changed_.notify_all();
    changed_.wait(lock, stop, [this] { return stops_ > 0; });
    moving_ = false;
    return Cancelled("move");
  }
  Status Stop() override {
    const std::lock_guard lock(mutex_);
    ++stops_;
    changed_.notify_all();
    return {};
  }
  Status Abort() override { return Stop(); }
  Status LoseHeartbeat() override {
    ++lost;
    return Stop();
  }
  MotionStatus ReadStatus() override {
    const std::lock_guard lock(mutex_);
    MotionStatus status;
    status.turntable = moving_ ? AxisState::moving : AxisState::idle;
    status.lift = AxisState::held;
    status.reference_epoch = 3;
    status.position = SomePosition();
    return status;
  }
  void WaitUntilMoving() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return moving_; });
  }
  std::atomic<int> lost = 0;
  int stops() {
    const std::lock_guard lock(mutex_);
    return stops_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool moving_ = false;
  int stops_ = 0;
};

struct Wire {
  Wire() {
    auto pair = SocketPair();
    channel = std::make_unique<Channel>(std::move(pair->first));
    client = std::make_unique<MotionClient>(std::move(pair->second));
    server = std::jthread([this](std::stop_token stop) { ServeMotion(*channel, motion, stop); });
  }
  EndlessMotion motion;
  std::unique_ptr<Channel> channel;
  std::unique_ptr<MotionClient> client;
  std::jthread server;
};

TEST(MotionProtocol, ReportsArriveUnchanged) {
  Wire wire;
  const auto home = wire.client->Home({});
  ASSERT_TRUE(home);
  EXPECT_EQ(home->reference_epoch, 3);
  EXPECT_EQ(home->position, SomePosition());
  EXPECT_EQ(wire.client->ReadStatus().lift, AxisState::held);
}

TEST(MotionProtocol, ErrorsKeepKindWhereAndMend) {
  Wire wire;
  const auto refused = wire.client->MoveTo({.turntable_deg = 0, .lift_mm = -1}, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(refused.error().mend, "stay above 0");
}

TEST(MotionProtocol, AStopTokenReachesAMoveInProgress) {
  Wire wire;
  std::stop_source stop;
  std::jthread stopper([&] {
    wire.motion.WaitUntilMoving();
    stop.request_stop();
  });
  const auto move = wire.client->MoveTo({.turntable_deg = 10}, stop.get_token());
  ASSERT_FALSE(move);
  EXPECT_EQ(move.error().kind, ErrorKind::cancelled);
  EXPECT_FALSE(wire.client->MoveTo({.turntable_deg = 10}, stop.get_token()))
      << "a token already requested starts nothing";
}

TEST(MotionProtocol, APeerThatDiesWhileMovingStopsTheMotion) {
  Wire wire;
  std::jthread mover([&] { (void)wire.client->MoveTo({.turntable_deg = 10}, {}); });
  wire.motion.WaitUntilMoving();
  wire.channel->Close();
  mover.join();
  wire.server.join();
  EXPECT_GE(wire.motion.stops(), 1);
  EXPECT_EQ(wire.motion.lost, 1);
  EXPECT_EQ(wire.client->ReadStatus().turntable, AxisState::fault);
}

TEST(MotionProtocol, OnlyTheLossOfTheClientThatMovesStopsTheMotion) {
  TempFolder folder;
  const auto socket = folder.path() / "motion";
  EndlessMotion motion;
  const auto server = ListenForMotion(socket, motion, {"lab", "0123"});
  ASSERT_TRUE(server) << ToString(server.error());
  Channel mover(std::move(*ConnectUnix(socket)));
  {
    MotionClient onlooker(std::move(*ConnectUnix(socket)));
    ASSERT_TRUE(mover.Send(
        {{"id", 1}, {"call", "move_to"}, {"params", ToJson(StageTarget{.turntable_deg = 10})}}));
    motion.WaitUntilMoving();
    EXPECT_EQ(onlooker.ReadStatus().turntable, AxisState::moving);
  }
  MotionClient other(std::move(*ConnectUnix(socket)));
  EXPECT_EQ(other.ReadStatus().turntable, AxisState::moving);
  EXPECT_EQ(motion.lost, 0);
  mover.Close();
  while (other.ReadStatus().turntable == AxisState::moving) std::this_thread::yield();
  EXPECT_EQ(motion.lost, 1);
}

// Remembers what it was asked for.
class NotedLamp final : public Lamp {
 public:
  Status SetLevel(double asked) override {
    if (broken) return DeviceFault("burnt out", "lamp", "change it");
    level = asked;
    return {};
  }
  std::atomic<double> level = 0;
  std::atomic<bool> broken = false;
};

struct LitStation {
  LitStation() {
    server = std::move(*ListenForMotion(socket, motion, {"lab", "0123"}, {&lamp, 0.75, 0}));
  }
  std::unique_ptr<MotionClient> Connect() {
    return std::make_unique<MotionClient>(std::move(*ConnectUnix(socket)));
  }
  TempFolder folder;
  std::filesystem::path socket = folder.path() / "motion";
  EndlessMotion motion;
  NotedLamp lamp;
  std::unique_ptr<RpcServer> server;
};

TEST(MotionProtocol, OnIsTheLevelOfTheStationFileAndFaultsArrive) {
  LitStation station;
  const auto client = station.Connect();
  const auto light = client->MakeLight(std::make_shared<SystemClock>());
  for (const bool on : {true, true, false, false, true}) {
    const Status set = light->Set(on);
    ASSERT_TRUE(set) << ToString(set.error());
    EXPECT_EQ(station.lamp.level, on ? 0.75 : 0);
  }
  ASSERT_TRUE(client->SetLightLevel(0.5));
  EXPECT_EQ(station.lamp.level, 0.5);
  station.lamp.broken = true;
  EXPECT_EQ(light->Set(false).error().what, "burnt out");
}

TEST(MotionProtocol, TheLampBelongsToWhoSwitchedItOnUntilThatOneHasGone) {
  LitStation station;
  auto client = station.Connect();
  const auto other = station.Connect();
  ASSERT_TRUE(client->SetLightLevel(1));
  EXPECT_EQ(other->SetLightLevel(0).error().kind, ErrorKind::bad_input);
  EXPECT_EQ(station.lamp.level, 1);
  client.reset();
  while (station.lamp.level > 0) std::this_thread::yield();
  EXPECT_TRUE(other->SetLightLevel(0.25));
  EXPECT_EQ(station.lamp.level, 0.25);
}

TEST(MotionProtocol, AClientThatFallsSilentLeavesTheLampDark) {
  LitStation station;
  Channel silent(std::move(*ConnectUnix(station.socket)));
  ASSERT_TRUE(silent.Send({{"id", 1}, {"call", "set_light"}, {"params", {{"on", true}}}}));
  while (station.lamp.level == 0) std::this_thread::yield();
  while (station.lamp.level > 0) std::this_thread::yield();  // no heartbeat
}

TEST(MotionProtocol, AStationWithoutALampSaysSo) {
  TempFolder folder;
  EndlessMotion motion;
  const auto server = ListenForMotion(folder.path() / "motion", motion, {"lab", "0123"});
  MotionClient client(std::move(*ConnectUnix(folder.path() / "motion")));
  EXPECT_EQ(client.SetLightLevel(1).error().kind, ErrorKind::bad_input);
}

TEST(MotionProtocol, MalformedMessagesNameTheField) {
  EXPECT_EQ(StageTargetFromJson(Json{{"lift_mm", 3}}).error().kind, ErrorKind::bad_input);
  EXPECT_FALSE(MotionStatusFromJson(Json(3)));
  for (const Json& answer : {Json(3), Json::object(), Json{{"settle_ms", "soon"}},
                             Json{{"settle_ms", -1}}, Json{{"settle_ms", 1e300}}}) {
    EXPECT_EQ(SettleMsFromJson(answer).error().kind, ErrorKind::bad_input) << answer;
  }
  EXPECT_EQ(SettleMsFromJson(Json{{"settle_ms", 20}}), 20);
  Json status = ToJson(MotionStatus{});
  status["lift"] = "flying";
  EXPECT_FALSE(MotionStatusFromJson(status));
}

}  // namespace
}  // namespace scan
