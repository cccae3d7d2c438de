// SHA-256 in lower-case hex.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace scan {

std::string Sha256Hex(std::span<const std::byte> bytes);

}  // namespace scan
