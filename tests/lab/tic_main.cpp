// lab_tic: a Tic board as a USB gadget: a simulated board behind FunctionFS, so that the guest's
// own USB stack carries every transfer. usage: lab_tic FOLDER START   FOLDER: where FunctionFS is
// mounted; START: the motor's place in microsteps from the edge of its reverse limit switch.
// FOLDER.place always holds its place now. Runs until ended.
#include <fcntl.h>
#include <fmt/format.h>
#include <linux/usb/functionfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <vector>

#include "drivers/base/clock.h"
#include "drivers/base/unique_fd.h"
#include "drivers/motion/tic/sim_tic.h"

namespace {

void Append(std::vector<std::uint8_t>& out, std::uint32_t value) {
  for (int k = 0; k < 4; ++k) out.push_back(static_cast<std::uint8_t>(value >> (8 * k)));
}

// One vendor specific interface with one endpoint that nobody uses; all control requests to the
// device are ours.
std::vector<std::uint8_t> Descriptors() {
  const std::vector<std::uint8_t> interface { 9, 4, 0, 0, 1, 0xff, 0, 0, 0 };
  const auto endpoint = [](std::uint8_t low, std::uint8_t high) {
    return std::vector<std::uint8_t>{7, 5, 0x81, 2, low, high, 0};
  };
  std::vector<std::uint8_t> out;
  const std::uint32_t length = 12 + 8 + 2 * (9 + 7);
  Append(out, FUNCTIONFS_DESCRIPTORS_MAGIC_V2);
  Append(out, length);
  Append(out, FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC | FUNCTIONFS_ALL_CTRL_RECIP);
  Append(out, 2);
  Append(out, 2);
  for (const auto& bulk : {endpoint(64, 0), endpoint(0, 2)}) {
    out.insert(out.end(), interface.begin(), interface.end());
    out.insert(out.end(), bulk.begin(), bulk.end());
  }
  return out;
}

std::vector<std::uint8_t> Strings() {
  std::vector<std::uint8_t> out;
  Append(out, FUNCTIONFS_STRINGS_MAGIC);
  Append(out, 16);
  Append(out, 0);
  Append(out, 0);
  return out;
}

bool WriteAll(int fd, const std::vector<std::uint8_t>& bytes) {
  return write(fd, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
}

// The transfer's data stage; going the other way stalls it.
void Answer(int ep0, scan::SimTic& tic, const usb_ctrlrequest& setup) {
  const scan::UsbControl control{setup.bRequestType, setup.bRequest, setup.wValue, setup.wIndex};
  std::vector<std::byte> data(setup.wLength);
  [[maybe_unused]] ssize_t done = 0;
  if (setup.bRequestType & USB_DIR_IN) {
    done = tic.Read(control, data) ? write(ep0, data.data(), data.size()) : read(ep0, nullptr, 0);
  } else if (tic.Write(control, {})) {
    done = read(ep0, data.data(), data.size());
  } else {
    done = write(ep0, nullptr, 0);
  }
}

void WritePlace(const std::string& path, std::int64_t place) {
  std::ofstream(path + ".new") << place << '\n';
  std::filesystem::rename(path + ".new", path);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "usage: lab_tic FOLDER START\n");
    return 2;
  }
  const scan::UniqueFd ep0(open(fmt::format("{}/ep0", argv[1]).c_str(), O_RDWR | O_CLOEXEC));
  if (!ep0 || !WriteAll(ep0.get(), Descriptors()) || !WriteAll(ep0.get(), Strings())) {
    fmt::print(stderr, "lab_tic: {}: {}\n", argv[1], std::strerror(errno));
    return 1;
  }
  scan::SimTic::Options options;
  options.clock = std::make_shared<scan::SystemClock>();
  options.settings.reverse_limit_pins = 1;
  options.reverse_edge = 0;
  options.start = std::atoll(argv[2]);
  scan::SimTic tic(options);
  const std::string place_file = std::string(argv[1]) + ".place";
  WritePlace(place_file, tic.place());
  fmt::print("board in {}\n", argv[1]);
  fflush(stdout);
  for (;;) {
    usb_functionfs_event event{};
    const ssize_t got = read(ep0.get(), &event, sizeof(event));
    if (got < 0 && errno == EINTR) continue;
    if (got < static_cast<ssize_t>(sizeof(event))) return 1;
    if (event.type == FUNCTIONFS_SETUP) Answer(ep0.get(), tic, event.u.setup);
    WritePlace(place_file, tic.place());
  }
}
