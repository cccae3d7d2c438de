// Puts the station's questions to whoever sits at this terminal.
#pragma once

#include <string>

#include "firmware-host/protocol/rpc_client.h"

namespace scan {

class OperatorDialogue {
 public:
  // Given the `question` of the daemon's status, again and again: prints a new one on standard
  // error and sends the line typed in answer. Where standard input is no terminal the question can
  // be answered by `scanstation confirm` or on the page. Never waits.
  void Follow(RpcClient& daemon, const std::string& question);

 private:
  std::string shown_;
};

}  // namespace scan
