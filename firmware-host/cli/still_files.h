// Names of pictures that are taken by hand.
#pragma once

#include <filesystem>
#include <string>

namespace scan {

// still.jpg, or still-3.jpg where several are taken; the extension is the picture's own.
std::filesystem::path NumberedPath(const std::filesystem::path& out, const std::string& extension,
                                   int number, int count);

}  // namespace scan
