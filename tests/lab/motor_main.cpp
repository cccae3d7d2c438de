// lab_motor STATE TURNTABLE LIFT: the motors of the lab as a program for suites, from these
// positions in steps. After each line on its standard input it writes what it has counted to STATE,
// whole: "turntable POSITION EDGES POWERED", and the lift's. Ends with its input.
#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>

#include "tests/lab/motor_model.h"

namespace {

using namespace scan;

Status Serve(const std::string& path, std::int64_t turntable, std::int64_t lift) {
  SCAN_TRY(const LabBoard board, LabBoardFromEnvironment());
  SCAN_TRY(const auto model, MotorModel::Start(board, {LabTurntable(turntable), LabLift(lift)}));
  fmt::print("ready\n");
  std::fflush(stdout);
  for (std::string line; std::getline(std::cin, line);) {
    SCAN_CHECK(model->Sync());
    std::ofstream out(path + ".new");
    for (const char* name : {"turntable", "lift"}) {
      const LabMotorState state = model->State(name);
      out << fmt::format("{} {} {} {}\n", name, state.position, state.edges, state.powered ? 1 : 0);
    }
    out.close();
    std::filesystem::rename(path + ".new", path);
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    fmt::print(stderr, "usage: lab_motor STATE TURNTABLE LIFT\n");
    return 2;
  }
  if (const Status served = Serve(argv[1], std::atoll(argv[2]), std::atoll(argv[3])); !served) {
    fmt::print(stderr, "lab_motor: {}\n", ToString(served.error()));
    return 1;
  }
  return 0;
}
