// An output folder that appears whole or not at all.
#pragma once

#include <filesystem>

#include "drivers/base/result.h"

namespace scan {

// Written beside its target under another name, renamed by Commit; removed when never committed.
class StagedFolder {
 public:
  // An existing non-empty target is refused unless `force`, which replaces it at Commit.
  // Errors: bad_input.
  static Result<StagedFolder> Create(const std::filesystem::path& target, bool force);
  StagedFolder(StagedFolder&& other) noexcept;
  StagedFolder& operator=(StagedFolder&&) = delete;
  ~StagedFolder();

  const std::filesystem::path& path() const { return staging_; }
  const std::filesystem::path& target() const { return target_; }
  Status Commit();

 private:
  StagedFolder(std::filesystem::path target, std::filesystem::path staging)
      : target_(std::move(target)), staging_(std::move(staging)) {}
  std::filesystem::path target_, staging_;
};

}  // namespace scan
