// The lamp of scanstation-motiond, over its protocol, under the contract suite.
#include "drivers/io/gpio/gpio_lamp.h"
#include "drivers/io/gpio/sim_gpio_board.h"
#include "firmware-host/protocol/motion_client.h"
#include "firmware-host/protocol/motion_server.h"
#include "firmware-host/protocol/socket.h"
#include "tests/contract/twin.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

// Stands still: the contract is the lamp's.
class StillMotion final : public Motion {
 public:
  Result<HomeReport> Home(std::stop_token) override { return HomeReport{}; }
  Result<MoveReport> MoveTo(const StageTarget&, std::stop_token) override { return MoveReport{}; }
  Status Stop() override { return {}; }
  Status Abort() override { return {}; }
  MotionStatus ReadStatus() override { return {}; }
};

// A server with a lamp on a line.
struct LampServer {
  TempFolder folder;
  std::shared_ptr<SimGpioBoard> board = std::make_shared<SimGpioBoard>(
      "board", std::vector<std::string>{"LAMP"}, std::make_shared<SystemClock>());
  StillMotion motion;
  std::unique_ptr<Lamp> lamp;
  std::unique_ptr<RpcServer> server;
};

Twin<Light> MakeTwin() {
  const auto rig = std::make_shared<LampServer>();
  const std::filesystem::path socket = rig->folder.path() / "motion";
  Twin<Light> twin;
  twin.clock = std::make_shared<SystemClock>();
  twin.world = rig;
  auto lamp = OpenGpioLamp(rig->board->Opener(), "board", {"LAMP"});
  EXPECT_TRUE(lamp) << ToString(lamp.error());
  if (!lamp) return twin;
  rig->lamp = std::move(*lamp);
  auto server = ListenForMotion(socket, rig->motion, {"lab", "0123"}, {rig->lamp.get(), 1, 1});
  EXPECT_TRUE(server) << ToString(server.error());
  if (!server) return twin;
  rig->server = std::move(*server);
  auto fd = ConnectUnix(socket);
  EXPECT_TRUE(fd) << ToString(fd.error());
  if (fd) twin.device = MotionClient(std::move(*fd)).MakeLight(twin.clock);
  return twin;
}

INSTANTIATE_TEST_SUITE_P(Protocol, LightContract,
                         ::testing::Values(TwinFactory<Light>{"line", MakeTwin}),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace scan
