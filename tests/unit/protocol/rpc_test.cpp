#include "firmware-host/protocol/rpc.h"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <atomic>
#include <condition_variable>

#include "firmware-host/protocol/rpc_client.h"
#include "firmware-host/protocol/rpc_server.h"
#include "firmware-host/protocol/socket.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

using std::chrono::milliseconds;

// Blocks until its stop token is requested.
Result<Json> UntilStopped(const Json&, std::stop_token stop) {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  wake.wait(lock, stop, [] { return false; });
  return Cancelled("slow call");
}

RpcFunctions TestFunctions() {
  RpcFunctions functions;
  functions["twice"] = {[](const Json& params, std::stop_token) -> Result<Json> {
    if (!params.contains("x")) return BadInput("no x", "params.x", "give x");
    return Json(2 * params["x"].get<int>());
  }};
  functions["slow"] = {UntilStopped, /*immediate=*/false};
  functions["stop"] = {[](const Json&, std::stop_token) -> Result<Json> { return Json(true); },
                       /*immediate=*/true, /*cancels=*/true};
  return functions;
}

struct Served {
  explicit Served(milliseconds silence_limit = milliseconds(0)) {
    auto pair = SocketPair();
    channel = std::make_unique<Channel>(std::move(pair->first));
    peer = std::move(pair->second);
    thread = std::jthread([this, silence_limit](std::stop_token stop) {
      ServeConnection(*channel, TestFunctions(), silence_limit, stop, [this] { ++lost; });
      channel->Close();
    });
  }
  std::unique_ptr<Channel> channel;
  UniqueFd peer;
  std::atomic<int> lost = 0;
  std::jthread thread;
};

TEST(Rpc, ValuesAndErrorsComeBackToTheirCaller) {
  Served served;
  RpcClient client(std::move(served.peer));
  EXPECT_EQ(client.Call("twice", {{"x", 21}}).value(), 42);
  const auto missing = client.Call("twice");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(missing.error().where, "params.x");
  EXPECT_EQ(client.Call("none").error().kind, ErrorKind::bad_input);
}

TEST(Rpc, AParameterOfTheWrongTypeIsRefusedAndTheServerLivesOn) {
  Served served;
  RpcClient client(std::move(served.peer));
  const auto refused = client.Call("twice", {{"x", "many"}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
  EXPECT_FALSE(client.Call("twice", 3)) << "not even an object";
  EXPECT_EQ(client.Call("twice", {{"x", 2}}).value(), 4);
}

TEST(Rpc, AStopIsNeverQueuedBehindARunningCall) {
  Served served;
  RpcClient client(std::move(served.peer));
  std::atomic<bool> cancelled = false;
  std::jthread caller([&] {
    const auto answer = client.Call("slow");
    cancelled = !answer && answer.error().kind == ErrorKind::cancelled;
  });
  // Whether the slow call has begun or still waits to: the stop reaches it.
  EXPECT_TRUE(client.Call("twice", {{"x", 1}}));
  while (!cancelled) EXPECT_TRUE(client.Call("stop"));
}

TEST(Rpc, ASecondSlowCallIsRefusedWhileOneRuns) {
  Served served;
  Channel raw(std::move(served.peer));
  ASSERT_TRUE(raw.Send({{"id", 1}, {"call", "slow"}}));
  ASSERT_TRUE(raw.Send({{"id", 2}, {"call", "slow"}}));
  const auto refused = raw.Receive();
  ASSERT_TRUE(refused && *refused);
  EXPECT_EQ((**refused)["id"], 2);
  EXPECT_EQ((**refused)["error"]["kind"], "bad_input");
}

TEST(Rpc, ASilentPeerIsDroppedAfterTheLimit) {
  Served served(milliseconds(150));
  Channel raw(std::move(served.peer));
  EXPECT_FALSE(raw.Receive());  // closed from the other side
}

TEST(Rpc, APeerThatDiesOrFallsSilentDuringItsCallIsLost) {
  for (const bool dies : {false, true}) {
    Served served(dies ? milliseconds(0) : milliseconds(50));
    Channel peer(std::move(served.peer));
    ASSERT_TRUE(peer.Send({{"id", 1}, {"call", "slow"}}));
    if (dies) peer.Close();
    served.thread.join();
    EXPECT_EQ(served.lost, 1) << dies;
  }
}

TEST(Rpc, APeerThatGoesWithoutACallOrAfterAStopIsNotLost) {
  for (const bool calls : {false, true}) {
    Served served;
    Channel peer(std::move(served.peer));
    if (calls) {
      ASSERT_TRUE(peer.Send({{"id", 1}, {"call", "slow"}}));
      ASSERT_TRUE(peer.Send({{"id", 2}, {"call", "stop"}}));
    }
    peer.Close();
    served.thread.join();
    EXPECT_EQ(served.lost, 0) << calls;
  }
}

TEST(Rpc, GarbageEndsTheConnectionAndNothingElse) {
  for (const std::string& garbage :
       {std::string("{\"id\":\n"), std::string("\xff\xfe\n"), std::string(3 << 20, 'x')}) {
    Served served;
    std::jthread writer([fd = served.peer.get(), &garbage] {
      std::size_t done = 0;
      while (done < garbage.size()) {
        const ssize_t n = ::send(fd, garbage.data() + done, garbage.size() - done, MSG_NOSIGNAL);
        if (n <= 0) return;
        done += static_cast<std::size_t>(n);
      }
    });
    served.thread.join();
    writer.join();
  }
  Served served;
  Channel raw(std::move(served.peer));
  for (const Json& odd : {Json(3), Json::array(), Json(nullptr), Json{{"call", 7}}}) {
    ASSERT_TRUE(raw.Send(odd));
    const auto answer = raw.Receive();
    ASSERT_TRUE(answer && *answer);
    EXPECT_TRUE((**answer).contains("error"));
  }
}

TEST(Rpc, ServerRefusesASecondOneOnTheSameSocketAndReplacesADeadFile) {
  TempFolder folder;
  const auto path = folder.path() / "s.sock";
  auto first = RpcServer::Start(path, TestFunctions(), milliseconds(0));
  ASSERT_TRUE(first);
  EXPECT_EQ(RpcServer::Start(path, TestFunctions(), milliseconds(0)).error().kind,
            ErrorKind::bad_input);
  auto fd = ConnectUnix(path);
  ASSERT_TRUE(fd);
  RpcClient client(std::move(*fd));
  EXPECT_EQ(client.Call("twice", {{"x", 2}}).value(), 4);
  first->reset();
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_FALSE(client.Call("twice", {{"x", 2}}));
  { const auto left_behind = ListenUnix(path); }
  ASSERT_TRUE(std::filesystem::exists(path));
  EXPECT_TRUE(RpcServer::Start(path, TestFunctions(), milliseconds(0)));
}

TEST(Rpc, NobodyListensIsAnError) {
  TempFolder folder;
  EXPECT_EQ(ConnectUnix(folder.path() / "none").error().kind, ErrorKind::failed);
  EXPECT_EQ(ConnectUnix(std::string(200, 'x')).error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace scan
