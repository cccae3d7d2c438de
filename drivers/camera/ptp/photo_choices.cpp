#include "drivers/camera/ptp/photo_choices.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

namespace scan {
namespace {

std::string_view Trimmed(std::string_view text) {
  const auto space = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
  while (!text.empty() && space(text.front())) text.remove_prefix(1);
  while (!text.empty() && space(text.back())) text.remove_suffix(1);
  return text;
}

// A plain decimal number, all of the text, above zero.
std::optional<double> NumberOf(std::string_view text) {
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [at, code] = std::from_chars(text.data(), end, value, std::chars_format::fixed);
  if (code != std::errc() || at != end || !std::isfinite(value) || value <= 0) return std::nullopt;
  return value;
}

std::optional<double> FractionOf(std::string_view text) {
  const std::size_t slash = text.find('/');
  if (slash == std::string_view::npos) return NumberOf(text);
  const auto over = NumberOf(text.substr(0, slash)), under = NumberOf(text.substr(slash + 1));
  if (!over || !under) return std::nullopt;
  return *over / *under;
}

bool TakePrefix(std::string_view& text, std::string_view prefix) {
  const bool has = text.size() >= prefix.size() &&
                   std::equal(prefix.begin(), prefix.end(), text.begin(), [](char a, char b) {
                     return a == std::tolower(static_cast<unsigned char>(b));
                   });
  if (has) text.remove_prefix(prefix.size());
  return has;
}

}  // namespace

std::optional<double> ExposureUsOf(std::string_view choice) {
  std::string_view text = Trimmed(choice);
  if (text.ends_with('s') || text.ends_with('"')) text = Trimmed(text.substr(0, text.size() - 1));
  std::optional<double> seconds;
  const std::size_t quote = text.find('"'), gap = text.find(' ');
  if (quote != std::string_view::npos) {  // 1"3 is 1.3 s
    seconds =
        NumberOf(std::string(text.substr(0, quote)) + "." + std::string(text.substr(quote + 1)));
  } else if (gap != std::string_view::npos) {  // 1 1/3
    const auto whole = NumberOf(text.substr(0, gap));
    const std::string_view rest = Trimmed(text.substr(gap));
    const auto part = rest.find('/') == std::string_view::npos ? std::nullopt : FractionOf(rest);
    if (whole && part) seconds = *whole + *part;
  } else {
    seconds = FractionOf(text);
  }
  if (!seconds || !std::isfinite(1e6 * *seconds) || *seconds <= 0) return std::nullopt;
  return 1e6 * *seconds;
}

std::optional<double> IsoOf(std::string_view choice) {
  std::string_view text = Trimmed(choice);
  if (TakePrefix(text, "iso")) text = Trimmed(text);
  return NumberOf(text);
}

std::optional<double> FNumberOf(std::string_view choice) {
  std::string_view text = Trimmed(choice);
  if (!TakePrefix(text, "f/")) TakePrefix(text, "f");
  return NumberOf(Trimmed(text));
}

std::optional<double> BatteryPercentOf(std::string_view value) {
  std::string_view text = Trimmed(value);
  if (text == "Low" || text == "low") return 5;
  if (!text.ends_with('%')) return std::nullopt;
  text = Trimmed(text.substr(0, text.size() - 1));
  if (text == "0") return 0;
  return NumberOf(text);
}

Result<std::string> NearestChoice(const std::vector<std::string>& choices, ChoiceNumber number_of,
                                  double asked, double tolerance_rel, std::string_view what,
                                  std::string_view unit) {
  const std::string* nearest = nullptr;
  const std::string* below = nullptr;
  const std::string* above = nullptr;
  double nearest_off = 0, below_value = 0, above_value = 0;
  if (asked > 0 && std::isfinite(asked)) {
    for (const std::string& choice : choices) {
      const auto value = number_of(choice);
      if (!value) continue;
      const double off = std::abs(std::log(*value / asked));
      if (!nearest || off < nearest_off) nearest = &choice, nearest_off = off;
      if (*value <= asked && (!below || *value > below_value))
        below = &choice, below_value = *value;
      if (*value >= asked && (!above || *value < above_value))
        above = &choice, above_value = *value;
    }
    if (nearest && std::abs(*number_of(*nearest) - asked) <= tolerance_rel * asked) return *nearest;
  }
  std::string offered;
  if (below) offered += fmt::format("{:g} {} ({})", below_value, unit, *below);
  if (above)
    offered += fmt::format("{}{:g} {} ({})", below ? " or " : "", above_value, unit, *above);
  return BadInput(fmt::format("the camera offers no {} of {:g} {}", what, asked, unit),
                  std::string(what),
                  offered.empty() ? "choose one that 'device ptp get' shows"
                                  : "the next that it offers: " + offered);
}

}  // namespace scan
