// lab_toggle LABEL LINE COUNT: pulses a line with nothing but libgpiod around it and prints how
// many pulses a second: the bare loop that the driver's own rate is compared with.
#include <fmt/format.h>
#include <gpiod.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>

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

template <class Set>
void Pulse(long count, Set set) {
  const auto from = std::chrono::steady_clock::now();
  for (long k = 0; k < count; ++k) {
    set(true);
    set(false);
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - from;
  fmt::print("{:.0f} pulses/s\n", static_cast<double>(count) / took.count());
}

bool Run(const std::string& path, unsigned offset, long count) {
  gpiod_chip* chip = gpiod_chip_open(path.c_str());
  if (!chip) return false;
#if SCAN_GPIOD_MAJOR >= 2
  gpiod_line_settings* settings = gpiod_line_settings_new();
  gpiod_line_settings_set_direction(settings, GPIOD_LINE_DIRECTION_OUTPUT);
  gpiod_line_config* config = gpiod_line_config_new();
  gpiod_line_config_add_line_settings(config, &offset, 1, settings);
  gpiod_line_request* request = gpiod_chip_request_lines(chip, nullptr, config);
  if (request) {
    Pulse(count, [&](bool high) {
      gpiod_line_request_set_value(request, offset,
                                   high ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE);
    });
    gpiod_line_request_release(request);
  }
  gpiod_line_config_free(config);
  gpiod_line_settings_free(settings);
  const bool done = request != nullptr;
#else
  gpiod_line* line = gpiod_chip_get_line(chip, offset);
  const bool done = line && gpiod_line_request_output(line, "lab_toggle", 0) == 0;
  if (done) Pulse(count, [&](bool high) { gpiod_line_set_value(line, high); });
#endif
  gpiod_chip_close(chip);
  return done;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    fmt::print(stderr, "usage: lab_toggle LABEL LINE COUNT\n");
    return 2;
  }
  const std::string path = ChipPath(argv[1]);
  if (path.empty() || !Run(path, static_cast<unsigned>(std::atoi(argv[2])), std::atol(argv[3]))) {
    fmt::print(stderr, "lab_toggle: no chip '{}' with a free line {}\n", argv[1], argv[2]);
    return 1;
  }
  return 0;
}
