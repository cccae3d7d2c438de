// Whether a file holds all that it announces, where the reader behind would not tell.
#pragma once

#include <cstdint>
#include <filesystem>

#include "drivers/base/result.h"

namespace scan {

// Every page's directory and every strip or tile lie within the file (TIFF and BigTIFF).
// Errors: bad_input. Thread contract: pure. Source: TIFF 6.0, section 2.
Status CheckTiffWhole(const std::filesystem::path& path);

// The stream inflates to its end with the right checksum. Errors: bad_input. Thread contract: pure.
Status CheckGzipWhole(const std::filesystem::path& path);

// The zlib or gzip stream from `offset` on inflates to at least `bytes` bytes.
// Errors: bad_input. Thread contract: pure.
Status CheckDeflateWhole(const std::filesystem::path& path, std::uint64_t offset,
                         std::uint64_t bytes);

}  // namespace scan
