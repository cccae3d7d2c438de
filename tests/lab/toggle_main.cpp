// lab_toggle LABEL LINE COUNT: pulses a line with nothing but libgpiod around it and prints how
// many pulses a second: the bare loop that the driver's own rate is compared with.
#include <fmt/format.h>
#include <gpiod.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "drivers/io/gpio/gpiod_lines.h"

namespace {

// Chips have no lookup by label in libgpiod 2.
std::string ChipPath(const std::string& label) {
  for (const auto& entry : std::filesystem::directory_iterator("/dev")) {
    if (entry.path().filename().string().rfind("gpiochip", 0) != 0) continue;
    gpiod_chip* chip = gpiod_chip_open(entry.path().c_str());
    if (!chip) continue;
#if SCAN_GPIOD_MAJOR >= 2
    gpiod_chip_info* info = gpiod_chip_get_info(chip);
    const std::string found = info ? gpiod_chip_info_get_label(info) : "";
    gpiod_chip_info_free(info);
#else
    const std::string found = gpiod_chip_label(chip);
#endif
    gpiod_chip_close(chip);
    if (found == label) return entry.path().string();
  }
  return {};
}

// Pulses a second.
template <class Set>
double Pulse(long count, Set set) {
  const auto from = std::chrono::steady_clock::now();
  for (long k = 0; k < count; ++k) {
    set(true);
    set(false);
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - from;
  return static_cast<double>(count) / took.count();
}

// 0 when the line cannot be taken.
double BareRate(const std::string& path, unsigned offset, long count) {
  gpiod_chip* chip = gpiod_chip_open(path.c_str());
  if (!chip) return 0;
  double rate = 0;
#if SCAN_GPIOD_MAJOR >= 2
  gpiod_line_settings* settings = gpiod_line_settings_new();
  gpiod_line_settings_set_direction(settings, GPIOD_LINE_DIRECTION_OUTPUT);
  gpiod_line_config* config = gpiod_line_config_new();
  gpiod_line_config_add_line_settings(config, &offset, 1, settings);
  gpiod_line_request* request = gpiod_chip_request_lines(chip, nullptr, config);
  if (request) {
    rate = Pulse(count, [&](bool high) {
      gpiod_line_request_set_value(request, offset,
                                   high ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE);
    });
    gpiod_line_request_release(request);
  }
  gpiod_line_config_free(config);
  gpiod_line_settings_free(settings);
#else
  gpiod_line* line = gpiod_chip_get_line(chip, offset);
  if (line && gpiod_line_request_output(line, "lab_toggle", 0) == 0) {
    rate = Pulse(count, [&](bool high) { gpiod_line_set_value(line, high); });
  }
#endif
  gpiod_chip_close(chip);
  return rate;
}

double DriverRate(const std::string& label, unsigned offset, long count) {
  const auto lines = scan::OpenGpiodLines({label, "lab_toggle", {{std::to_string(offset), true}}});
  if (!lines) return 0;
  const scan::GpioLevel levels[] = {{0, false}, {0, true}};
  return Pulse(count, [&](bool high) { (void)(*lines)->Set({&levels[high ? 1 : 0], 1}); });
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4 && argc != 5) {
    fmt::print(stderr, "usage: lab_toggle LABEL LINE COUNT [PAIRS]\n");
    return 2;
  }
  const std::string path = ChipPath(argv[1]);
  const auto line = static_cast<unsigned>(std::atoi(argv[2]));
  const long count = std::atol(argv[3]);
  const double first = path.empty() ? 0 : BareRate(path, line, count);
  if (first == 0) {
    fmt::print(stderr, "lab_toggle: no chip '{}' with a free line {}\n", argv[1], argv[2]);
    return 1;
  }
  if (argc == 4) {
    fmt::print("{:.0f} pulses/s\n", first);
    return 0;
  }
  std::vector<double> bare, ratios;
  const int pairs = std::max(1, std::atoi(argv[4]));
  for (int k = 0; k < pairs; ++k) {
    bare.push_back(BareRate(path, line, count));
    ratios.push_back(DriverRate(argv[1], line, count) / bare.back());
  }
  std::sort(bare.begin(), bare.end());
  std::sort(ratios.begin(), ratios.end());
  const std::size_t middle = ratios.size() / 2;
  fmt::print(
      "figure: pulses through the driver {:.2f} of a bare libgpiod loop's {:.0f}/s (median of "
      "{})\n",
      ratios[middle], bare[middle], ratios.size());
  return 0;
}
