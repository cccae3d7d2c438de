// A Motion and a Light that live in scanstation-motiond.
#pragma once

#include <memory>

#include "drivers/base/clock.h"
#include "drivers/io/light.h"
#include "drivers/motion/motion.h"
#include "firmware-host/protocol/rpc_client.h"

namespace scan {

// A connection that sends a heartbeat every quarter of the server's limit, so that a dead daemon
// stops the motors and leaves the lamp dark. Thread contract: any thread.
class MotionLink {
 public:
  explicit MotionLink(UniqueFd fd);
  RpcClient& client() { return client_; }

 private:
  RpcClient client_;
  std::jthread heartbeat_;
};

// Thread contract: as Motion.
class MotionClient final : public Motion {
 public:
  explicit MotionClient(UniqueFd fd);

  Result<HomeReport> Home(std::stop_token stop) override;
  Result<MoveReport> MoveTo(const StageTarget& target, std::stop_token stop) override;
  Status Stop() override;
  Status Abort() override;
  Status Acknowledge() override;
  MotionStatus ReadStatus() override;

  // The same station's lamp over the same connection; Set(true) gives the level of the station file
  // and returns when the light has settled, by `clock`.
  std::unique_ptr<Light> MakeLight(std::shared_ptr<Clock> clock);
  // 0: off; it stays lit as long as this client lives.
  Status SetLightLevel(double level);

 private:
  Result<Json> CallStoppable(const std::string& function, Json params, std::stop_token stop);

  std::shared_ptr<MotionLink> link_;
};

}  // namespace scan
