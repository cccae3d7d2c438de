#include "firmware-host/cli/still_files.h"

#include <fmt/format.h>

namespace scan {

std::filesystem::path NumberedPath(const std::filesystem::path& out, const std::string& extension,
                                   int number, int count) {
  std::filesystem::path path = out;
  if (count > 1) path.replace_filename(fmt::format("{}-{}", out.stem().string(), number));
  return path.replace_extension(extension);
}

}  // namespace scan
