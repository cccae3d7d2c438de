// Unix stream sockets: the only way into the programs beside the loopback page.
#pragma once

#include <chrono>
#include <filesystem>
#include <utility>

#include "drivers/base/result.h"
#include "drivers/base/unique_fd.h"

namespace scan {

// A listening socket that only its owner may connect to (mode 0600). A dead socket file left at the
// path is replaced; a live one is refused. Errors: bad_input (path too long, in use, no rights).
Result<UniqueFd> ListenUnix(const std::filesystem::path& path);

// Retries until `patience` is over, for a program that is just starting.
// Errors: failed, when nobody listens.
Result<UniqueFd> ConnectUnix(const std::filesystem::path& path,
                             std::chrono::milliseconds patience = std::chrono::milliseconds(0));

// Where scanstationd listens unless told otherwise: $XDG_RUNTIME_DIR/scanstation.sock, else
// /run/scanstation/scanstation.sock.
std::filesystem::path DefaultSocket();

// Two connected sockets, for roles that share a process.
Result<std::pair<UniqueFd, UniqueFd>> SocketPair();

}  // namespace scan
