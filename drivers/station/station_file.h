// Reads a station's TOML file.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "drivers/base/result.h"
#include "drivers/station/station_config.h"

namespace scan {

// Every key may be left out: then DefaultSimStation() speaks. The whole file is checked.
// Errors: bad_input with file:line and key for a file that cannot be read, a syntax error, an
// unknown key, a wrong type, a value out of range, parts that do not fit together.
// Thread contract: pure.
Result<StationConfig> LoadStationConfig(const std::filesystem::path& path);

// The same from memory; `source` names the text in errors.
Result<StationConfig> ParseStationConfig(std::string_view text, const std::string& source);

}  // namespace scan
