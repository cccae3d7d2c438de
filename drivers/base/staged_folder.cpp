#include "drivers/base/staged_folder.h"

#include <unistd.h>

#include <string>
#include <system_error>

#include "drivers/base/files.h"

namespace scan {

namespace fs = std::filesystem;

Result<StagedFolder> StagedFolder::Create(const fs::path& target, bool force) {
  fs::path clean = fs::absolute(target).lexically_normal();
  if (!clean.has_filename()) clean = clean.parent_path();
  std::error_code code;
  const bool existed = fs::exists(clean, code);
  SCAN_CHECK(PrepareOutputFolder(clean, force));
  if (!existed) fs::remove(clean, code);  // it was only made to see that it can be
  fs::path staging = clean.parent_path() /
                     ("." + clean.filename().string() + ".part-" + std::to_string(::getpid()));
  fs::remove_all(staging, code);
  fs::create_directories(staging, code);
  if (code)
    return BadInput("cannot create the output folder (" + code.message() + ")", staging.string(),
                    "check the path and its rights");
  return StagedFolder(std::move(clean), std::move(staging));
}

StagedFolder::StagedFolder(StagedFolder&& other) noexcept
    : target_(std::move(other.target_)), staging_(std::move(other.staging_)) {
  other.staging_.clear();
}

StagedFolder::~StagedFolder() {
  std::error_code ignored;
  if (!staging_.empty()) fs::remove_all(staging_, ignored);
}

Status StagedFolder::Commit() {
  std::error_code code;
  const fs::path old = staging_.string() + ".old";
  const bool replace = fs::exists(target_, code);
  if (replace) fs::rename(target_, old, code);
  if (!code || !replace) fs::rename(staging_, target_, code);
  if (code && replace) {  // what was there stays there
    std::error_code ignored;
    if (!fs::exists(target_, ignored)) fs::rename(old, target_, ignored);
  }
  if (code)
    return Failed("cannot put the output in its place (" + code.message() + ")", target_.string(),
                  "check the folder's rights");
  staging_.clear();
  if (replace) fs::remove_all(old, code);
  return {};
}

}  // namespace scan
