// Files that appear whole or not at all.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/base/result.h"

namespace scan {

Result<std::string> ReadTextFile(const std::filesystem::path& path);
Result<std::vector<std::byte>> ReadBinaryFile(const std::filesystem::path& path);

// Writes beside the target, syncs the file, renames over it, syncs the folder. After a power cut
// the path holds the old bytes or the new ones, never a mixture.
Status WriteFileDurably(const std::filesystem::path& path, std::span<const std::byte> bytes);
Status WriteFileDurably(const std::filesystem::path& path, std::string_view text);

// Creates an output folder. An existing non-empty one is refused unless `force`.
Status PrepareOutputFolder(const std::filesystem::path& folder, bool force);

// Refuses an existing output file unless `force`; creates its parent folder.
Status PrepareOutputFile(const std::filesystem::path& file, bool force);

inline std::span<const std::byte> AsBytes(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

}  // namespace scan
