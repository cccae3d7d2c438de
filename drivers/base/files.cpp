#include "drivers/base/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "drivers/base/unique_fd.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

std::string ErrnoText() { return std::strerror(errno); }

tl::unexpected<Error> ReadError(const fs::path& path) {
  return BadInput("cannot read (" + ErrnoText() + ")", path.string(),
                  "check that the file exists and may be read");
}
tl::unexpected<Error> WriteError(const fs::path& path) {
  return Failed("cannot write (" + ErrnoText() + ")", path.string(),
                "check the folder, its rights and the free space");
}

template <class Buffer>
Result<Buffer> ReadAll(const fs::path& path) {
  UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat info {};
  if (!fd || ::fstat(fd.get(), &info) != 0) return ReadError(path);
  if (!S_ISREG(info.st_mode))
    return BadInput("not a regular file", path.string(), "name a file, not a folder or device");
  Buffer buffer;
  buffer.resize(static_cast<std::size_t>(info.st_size));
  std::size_t done = 0;
  while (done < buffer.size()) {
    const ssize_t n = ::read(fd.get(), buffer.data() + done, buffer.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return ReadError(path);
    if (n == 0) break;
    done += static_cast<std::size_t>(n);
  }
  buffer.resize(done);
  return buffer;
}

Status SyncFolder(const fs::path& folder) {
  UniqueFd fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd || ::fsync(fd.get()) != 0) return WriteError(folder);
  return {};
}

Status WriteAndSync(const fs::path& path, std::span<const std::byte> bytes) {
  UniqueFd fd(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (!fd) return WriteError(path);
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd.get(), bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return WriteError(path);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  if (::fsync(fd.get()) != 0) return WriteError(path);
  return {};
}

}  // namespace

Result<std::string> ReadTextFile(const fs::path& path) { return ReadAll<std::string>(path); }

Result<std::vector<std::byte>> ReadBinaryFile(const fs::path& path) {
  return ReadAll<std::vector<std::byte>>(path);
}

Status WriteFileDurably(const fs::path& path, std::span<const std::byte> bytes) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  const fs::path beside = folder / ("." + path.filename().string() + ".part");
  if (auto written = WriteAndSync(beside, bytes); !written) {
    ::unlink(beside.c_str());
    return written;
  }
  if (::rename(beside.c_str(), path.c_str()) != 0) {
    auto error = WriteError(path);
    ::unlink(beside.c_str());
    return error;
  }
  return SyncFolder(folder);
}

Status WriteFileDurably(const fs::path& path, std::string_view text) {
  return WriteFileDurably(path, AsBytes(text));
}

Status PrepareOutputFolder(const fs::path& folder, bool force) {
  std::error_code code;
  if (fs::exists(folder, code)) {
    if (!fs::is_directory(folder, code))
      return BadInput("the output exists and is no folder", folder.string(), "name another --out");
    if (!force && !fs::is_empty(folder, code))
      return BadInput("the output folder exists and is not empty", folder.string(),
                      "name another --out or add --force");
    return {};
  }
  fs::create_directories(folder, code);
  if (code)
    return BadInput("cannot create the output folder (" + code.message() + ")", folder.string(),
                    "check the path and its rights");
  return {};
}

Status PrepareOutputFile(const fs::path& file, bool force) {
  std::error_code code;
  if (fs::exists(file, code) && (!force || fs::is_directory(file, code)))
    return BadInput("the output exists", file.string(), "name another --out or add --force");
  if (file.has_parent_path()) {
    fs::create_directories(file.parent_path(), code);
    if (code)
      return BadInput("cannot create the output folder (" + code.message() + ")",
                      file.parent_path().string(), "check the path and its rights");
  }
  return {};
}

}  // namespace scan
