// What differs between the two interfaces of libgpiod: gpiod1_lines.cpp or gpiod2_lines.cpp has it.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "drivers/io/gpio/gpio_lines.h"

namespace scan {

// Nothing when the chip cannot be opened.
std::optional<GpioChipInfo> DescribeGpiodChip(const std::string& path);

// Errors: errno of the refusal.
tl::expected<std::unique_ptr<GpioLines>, int> TakeGpiodLines(const GpioChipInfo& chip,
                                                             const GpioRequest& request,
                                                             std::span<const unsigned> offsets);

// A call for a line that is held has failed; errno says why. `what`: "cannot set".
tl::unexpected<Error> GpiodLineFault(const char* what, const std::string& chip_label,
                                     const std::string& line);

}  // namespace scan
