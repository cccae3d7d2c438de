#include "drivers/io/gpio/gpiod_lines.h"

#include <fmt/format.h>

#include <cassert>
#include <cerrno>
#include <cstring>

#include "drivers/io/gpio/chip_files.h"
#include "drivers/io/gpio/gpiod_chip.h"

namespace scan {

std::vector<GpioChipInfo> ListGpiodChips() {
  std::vector<GpioChipInfo> chips;
  for (const std::string& path : GpioChipPaths()) {
    if (auto chip = DescribeGpiodChip(path)) chips.push_back(*std::move(chip));
  }
  return chips;
}

Result<std::unique_ptr<GpioLines>> OpenGpiodLines(const GpioRequest& request) {
  assert(!request.lines.empty());
  const auto chips = ListGpiodChips();
  SCAN_TRY(const GpioPlace place, FindGpioLines(chips, request));
  const GpioChipInfo& chip = chips[place.chip];
  auto lines = TakeGpiodLines(chip, request, place.offsets);
  if (lines) return *std::move(lines);
  return tl::unexpected(GpioRequestError(chip, request, place.offsets, lines.error()));
}

tl::unexpected<Error> GpiodLineFault(const char* what, const std::string& chip_label,
                                     const std::string& line) {
  return DeviceFault(fmt::format("{} the line: {}", what, std::strerror(errno)),
                     fmt::format("gpio {}/{}", chip_label, line),
                     "check that the board is still there, then start again");
}

}  // namespace scan
