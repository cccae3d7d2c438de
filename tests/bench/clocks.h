// Seconds of the clock and of the processor, for the benchmarks.
#pragma once

#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <string>

namespace scan::bench {

inline double Seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Of all threads of this process.
inline double ProcessorSeconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

// What a host has taken from this virtual machine since it was started; 0 on a real one.
inline double StolenSeconds() {
  std::ifstream file("/proc/stat");
  std::string cpu;
  double user, nice, system, idle, wait, irq, soft_irq, stolen;
  if (!(file >> cpu >> user >> nice >> system >> idle >> wait >> irq >> soft_irq >> stolen))
    return 0;
  return stolen / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

}  // namespace scan::bench
