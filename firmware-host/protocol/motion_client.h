// A Motion that lives in scanstation-motiond.
#pragma once

#include <memory>

#include "drivers/motion/motion.h"
#include "firmware-host/protocol/rpc_client.h"

namespace scan {

// Sends a heartbeat every quarter of the server's limit, so that a dead daemon stops the motors.
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

 private:
  Result<Json> CallStoppable(const std::string& function, Json params, std::stop_token stop);

  RpcClient client_;
  std::jthread heartbeat_;
};

}  // namespace scan
