#include "drivers/io/gpio/gpio_lines.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>

namespace scan {
namespace {

std::vector<unsigned> OffsetsOf(const GpioChipInfo& chip, const std::string& name) {
  std::vector<unsigned> found;
  for (unsigned k = 0; k < chip.lines.size(); ++k) {
    if (!name.empty() && chip.lines[k].name == name) found.push_back(k);
  }
  if (!found.empty()) return found;
  unsigned number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (error == std::errc() && end == name.data() + name.size() && number < chip.lines.size()) {
    found.push_back(number);
  }
  return found;
}

std::string Labels(std::span<const GpioChipInfo> chips) {
  std::vector<std::string> labels;
  for (const GpioChipInfo& chip : chips) labels.push_back(chip.label);
  return labels.empty() ? "none" : fmt::format("{}", fmt::join(labels, ", "));
}

std::string Names(const GpioRequest& request) {
  std::vector<std::string_view> names;
  for (const GpioLineConfig& line : request.lines) names.push_back(line.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

Result<std::vector<unsigned>> OffsetsOn(const GpioChipInfo& chip, const GpioRequest& request) {
  std::vector<unsigned> offsets;
  for (const GpioLineConfig& line : request.lines) {
    const auto found = OffsetsOf(chip, line.name);
    const std::string where = fmt::format("gpio {}/{}", chip.label, line.name);
    if (found.empty()) {
      return DeviceFault("the chip has no such line", where,
                         "name one that 'scanstation device gpio list' shows, or its number");
    }
    if (found.size() > 1) {
      return DeviceFault(fmt::format("{} lines of the chip have this name", found.size()), where,
                         "give the line's number on the chip instead");
    }
    if (std::find(offsets.begin(), offsets.end(), found[0]) != offsets.end()) {
      return DeviceFault("the line is asked for twice", where, "give each line one task");
    }
    offsets.push_back(found[0]);
  }
  return offsets;
}

}  // namespace

Result<GpioPlace> FindGpioLines(std::span<const GpioChipInfo> chips, const GpioRequest& request) {
  std::vector<std::size_t> candidates;
  for (std::size_t k = 0; k < chips.size(); ++k) {
    const bool has_names =
        std::all_of(request.lines.begin(), request.lines.end(), [&](const GpioLineConfig& line) {
          return std::any_of(chips[k].lines.begin(), chips[k].lines.end(),
                             [&](const GpioLineInfo& info) { return info.name == line.name; });
        });
    if (request.chip.empty() ? has_names : chips[k].label == request.chip) candidates.push_back(k);
  }
  const std::string wanted =
      request.chip.empty() ? "chip with all of these lines" : "chip '" + request.chip + "'";
  if (candidates.empty()) {
    return DeviceFault(
        fmt::format("there is no {} ({}; chips here: {})", wanted, Names(request), Labels(chips)),
        fmt::format("gpio {}", request.chip.empty() && !request.lines.empty()
                                   ? request.lines.front().name
                                   : request.chip),
        "give the label of a chip and names of its lines as 'scanstation device gpio list' shows "
        "them, "
        "and check that this user may open /dev/gpiochip*");
  }
  if (candidates.size() > 1) {
    return DeviceFault(fmt::format("there is more than one {} ({})", wanted, Names(request)),
                       "gpio",
                       request.chip.empty() ? "give the chip's label" : "detach one of them");
  }
  SCAN_TRY(auto offsets, OffsetsOn(chips[candidates[0]], request));
  return GpioPlace{candidates[0], std::move(offsets)};
}

Error GpioRequestError(const GpioChipInfo& chip, const GpioRequest& request,
                       std::span<const unsigned> offsets, int error_number) {
  std::string name = request.lines.empty() ? "" : request.lines.front().name, holder;
  for (std::size_t k = 0; k < offsets.size(); ++k) {
    const GpioLineInfo& info = chip.lines[offsets[k]];
    if (!info.used) continue;
    name = request.lines[k].name;
    holder = info.consumer;
    break;
  }
  std::string mend = "check the line in the station file and the kernel's messages";
  if (error_number == EBUSY) {
    mend = fmt::format("end the program that holds it ({}), or free the pin from its function",
                       holder.empty() ? "unknown" : holder);
  } else if (error_number == EACCES || error_number == EPERM) {
    mend = "let this user open " + chip.path + ": add it to the group of that file";
  }
  return {ErrorKind::device, fmt::format("cannot take the line: {}", std::strerror(error_number)),
          fmt::format("gpio {}/{}", chip.label, name), mend};
}

}  // namespace scan
