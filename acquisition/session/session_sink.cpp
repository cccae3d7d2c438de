#include "acquisition/session/session_sink.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "acquisition/session/session_paths.h"
#include "drivers/base/files.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> DiskError(const char* what, const fs::path& path) {
  return Failed(std::string(what) + " (" + std::strerror(errno) + ")", path.string(),
                "check the folder, its rights and the free space");
}

Status SyncFolder(const fs::path& folder) {
  UniqueFd fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd || ::fsync(fd.get()) != 0) return DiskError("cannot sync", folder);
  return {};
}

}  // namespace

FolderSink::FolderSink(fs::path folder) : folder_(fs::absolute(std::move(folder))) {
  if (!folder_.has_filename()) folder_ = folder_.parent_path();  // a trailing slash
}

Status FolderSink::CreateFolder(const fs::path& folder) {
  if (folder.empty()) {
    SCAN_CHECK(PrepareOutputFolder(folder_, false));
    return SyncFolder(folder_.parent_path());
  }
  const fs::path path = folder_ / folder;
  std::error_code code;
  fs::create_directories(path, code);
  if (code)
    return Failed("cannot create the folder (" + code.message() + ")", path.string(),
                  "check the path and its rights");
  return SyncFolder(path.parent_path());
}

Status FolderSink::WriteFile(const fs::path& file, std::span<const std::byte> bytes) {
  return WriteFileDurably(folder_ / file, bytes);
}

Status FolderSink::LockLog() {
  if (log_) return {};
  const fs::path path = folder_ / kLogFile;
  UniqueFd log(::open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0644));
  if (!log) return DiskError("cannot open", path);
  if (::flock(log.get(), LOCK_EX | LOCK_NB) != 0)
    return Failed("another program is writing this session", folder_.string(),
                  "stop it, or wait until it has ended");
  SCAN_CHECK(SyncFolder(folder_));
  log_ = std::move(log);
  return {};
}

Status FolderSink::AppendToLog(std::string_view line) {
  SCAN_CHECK(LockLog());
  std::string text(line);
  text += '\n';
  std::string_view rest = text;
  while (!rest.empty()) {
    const ssize_t n = ::write(log_.get(), rest.data(), rest.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return DiskError("cannot write", folder_ / kLogFile);
    rest.remove_prefix(static_cast<std::size_t>(n));
  }
  if (::fsync(log_.get()) != 0) return DiskError("cannot sync", folder_ / kLogFile);
  return {};
}

Status FolderSink::CutLog(std::uint64_t bytes) {
  SCAN_CHECK(LockLog());
  if (::ftruncate(log_.get(), static_cast<off_t>(bytes)) != 0 || ::fsync(log_.get()) != 0)
    return DiskError("cannot cut the torn last line", folder_ / kLogFile);
  return {};
}

}  // namespace scan
