#include "reconstruction/volume/whole_file.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <fstream>
#include <memory>
#include <set>
#include <vector>

namespace scan {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> Truncated(const fs::path& path) {
  return BadInput("the file is truncated or damaged", path.string(), "copy it again");
}

// Little- or big-endian numbers at any offset; `ok` falls when one lies beyond the end.
class Bytes {
 public:
  explicit Bytes(const fs::path& path) : file_(path, std::ios::binary) {
    file_.seekg(0, std::ios::end);
    size_ = file_ ? static_cast<std::uint64_t>(file_.tellg()) : 0;
  }
  std::uint64_t size() const { return size_; }
  bool ok() const { return ok_; }
  void set_big_endian(bool big) { big_ = big; }

  std::uint64_t At(std::uint64_t offset, int width) {
    std::array<unsigned char, 8> raw{};
    if (offset > size_ || static_cast<std::uint64_t>(width) > size_ - offset) {
      ok_ = false;
      return 0;
    }
    file_.seekg(static_cast<std::streamoff>(offset));
    file_.read(std::bit_cast<char*>(raw.data()), width);
    std::uint64_t value = 0;
    for (int n = 0; n < width; ++n) value = value << 8 | raw[big_ ? n : width - 1 - n];
    return value;
  }

 private:
  std::ifstream file_;
  std::uint64_t size_ = 0;
  bool ok_ = true, big_ = false;
};

// Offsets or byte counts of an entry of SHORT, LONG or LONG8 values.
std::vector<std::uint64_t> Values(Bytes& bytes, std::uint64_t entry, int word) {
  const std::uint64_t type = bytes.At(entry + 2, 2), count = bytes.At(entry + 4, word);
  const int width = type == 3 ? 2 : type == 4 ? 4 : type == 16 ? 8 : 0;
  std::vector<std::uint64_t> values;
  if (width == 0 || count > bytes.size()) return values;
  const bool inlined =
      count * static_cast<std::uint64_t>(width) <= static_cast<std::uint64_t>(word);
  const std::uint64_t at = inlined ? entry + 4 + static_cast<std::uint64_t>(word)
                                   : bytes.At(entry + 4 + static_cast<std::uint64_t>(word), word);
  for (std::uint64_t n = 0; n < count && bytes.ok(); ++n)
    values.push_back(bytes.At(at + n * static_cast<std::uint64_t>(width), width));
  return values;
}

// One directory; returns the offset of the next.
std::uint64_t CheckDirectory(Bytes& bytes, std::uint64_t at, int word, bool& whole) {
  const int count_width = word == 8 ? 8 : 2;
  const std::uint64_t entries = bytes.At(at, count_width);
  const std::uint64_t first = at + static_cast<std::uint64_t>(count_width);
  const std::uint64_t step = word == 8 ? 20 : 12;
  std::vector<std::uint64_t> offsets, counts;
  for (std::uint64_t n = 0; n < entries && bytes.ok(); ++n) {
    const std::uint64_t entry = first + n * step, tag = bytes.At(entry, 2);
    if (tag == 273 || tag == 324) offsets = Values(bytes, entry, word);
    if (tag == 279 || tag == 325) counts = Values(bytes, entry, word);
  }
  for (std::size_t n = 0; n < std::min(offsets.size(), counts.size()); ++n)
    whole = whole && offsets[n] <= bytes.size() && counts[n] <= bytes.size() - offsets[n];
  return bytes.At(first + entries * step, word);
}

}  // namespace

Status CheckTiffWhole(const fs::path& path) {
  Bytes bytes(path);
  bytes.set_big_endian(bytes.At(0, 2) == 0x4d4d);  // "MM", the same in both orders
  const int word = bytes.At(2, 2) == 43 ? 8 : 4;
  std::uint64_t directory = bytes.At(word == 8 ? 8 : 4, word);
  std::set<std::uint64_t> seen;
  bool whole = true;
  while (directory != 0 && bytes.ok() && whole && seen.insert(directory).second)
    directory = CheckDirectory(bytes, directory, word, whole);
  if (!bytes.ok() || !whole || directory != 0) return Truncated(path);
  return {};
}

Status CheckGzipWhole(const fs::path& path) {
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "rb"), gzclose);
  if (!file) return Truncated(path);
  std::vector<char> buffer(1 << 18);
  int read = 0;
  while ((read = gzread(file.get(), buffer.data(), static_cast<unsigned>(buffer.size()))) > 0) {
  }
  int code = Z_OK;
  gzerror(file.get(), &code);
  if (read < 0 || (code != Z_OK && code != Z_STREAM_END)) return Truncated(path);
  return {};
}

Status CheckDeflateWhole(const fs::path& path, std::uint64_t offset, std::uint64_t bytes) {
  std::ifstream file(path, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(offset));
  z_stream stream{};
  if (!file || inflateInit2(&stream, 15 + 32) != Z_OK) return Truncated(path);
  const std::unique_ptr<z_stream, int (*)(z_stream*)> ended(&stream, inflateEnd);
  std::vector<unsigned char> in(1 << 16), out(1 << 18);
  int code = Z_OK;
  std::uint64_t inflated = 0;
  while (code == Z_OK && inflated < bytes) {
    if (stream.avail_in == 0) {
      file.read(std::bit_cast<char*>(in.data()), static_cast<std::streamsize>(in.size()));
      stream.next_in = in.data();
      stream.avail_in = static_cast<unsigned>(file.gcount());
      if (stream.avail_in == 0) break;
    }
    stream.next_out = out.data();
    stream.avail_out = static_cast<unsigned>(out.size());
    code = inflate(&stream, Z_NO_FLUSH);
    inflated += out.size() - stream.avail_out;
  }
  if (inflated < bytes) return Truncated(path);
  return {};
}

}  // namespace scan
