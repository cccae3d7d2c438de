// What the session writer sees of a disk, so that faults can be injected.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

#include "drivers/base/result.h"
#include "drivers/base/unique_fd.h"

namespace scan {

// Paths are relative to the session folder; the empty path is the folder itself.
// Thread contract: one thread at a time. Errors: failed or bad_input, as the disk says.
class SessionSink {
 public:
  virtual ~SessionSink() = default;
  // Durable when it returns; an existing folder is no error, but the session folder itself must be
  // new or empty.
  virtual Status CreateFolder(const std::filesystem::path& folder) = 0;
  // Whole or not at all, durable when it returns.
  virtual Status WriteFile(const std::filesystem::path& file, std::span<const std::byte> bytes) = 0;
  // Appends line and newline to the log; durable when it returns. After an error a part of the line
  // may be on disk.
  virtual Status AppendToLog(std::string_view line) = 0;
  // Cuts the log to its first `bytes` bytes.
  virtual Status CutLog(std::uint64_t bytes) = 0;
};

// A folder on disk. Its log is locked against a second writer as long as the sink lives.
class FolderSink final : public SessionSink {
 public:
  explicit FolderSink(std::filesystem::path folder);

  Status CreateFolder(const std::filesystem::path& folder) override;
  Status WriteFile(const std::filesystem::path& file, std::span<const std::byte> bytes) override;
  Status AppendToLog(std::string_view line) override;
  Status CutLog(std::uint64_t bytes) override;

  // Opens and locks the log, creating it where it is missing. Errors: failed when another writer
  // holds it.
  Status LockLog();

 private:
  std::filesystem::path folder_;
  UniqueFd log_;
};

}  // namespace scan
