#include "drivers/motion/interlocks.h"

#include <algorithm>

namespace scan {
namespace {

std::size_t At(Interlock interlock) { return static_cast<std::size_t>(interlock); }

}  // namespace

void Interlocks::Raise(Interlock interlock) {
  latches_[At(interlock)].Raise(Row(interlock).alarm, Row(interlock).latched);
}

void Interlocks::CauseGone(Interlock interlock) { latches_[At(interlock)].CauseGone(); }

void Interlocks::Acknowledge() {
  for (AlarmLatch& latch : latches_) latch.Acknowledge();
}

void Interlocks::Homed() {
  for (const InterlockRow& row : kInterlockTable) {
    if (!Forbids(row.interlock, AxisCommand::home)) latches_[At(row.interlock)].Acknowledge();
  }
}

bool Interlocks::IsUp(Interlock interlock) const {
  return latches_[At(interlock)].alarm() != Alarm::none;
}

Alarm Interlocks::alarm() const {
  Alarm worst = Alarm::none;
  for (const AlarmLatch& latch : latches_) worst = std::max(worst, latch.alarm());
  return worst;
}

std::string Interlocks::Words() const {
  std::string words;
  for (const InterlockRow& row : kInterlockTable) {
    if (!IsUp(row.interlock)) continue;
    if (!words.empty()) words += ", ";
    words += row.name;
  }
  return words;
}

Status Interlocks::Permit(AxisCommand command) const {
  for (const InterlockRow& row : kInterlockTable) {
    if (!IsUp(row.interlock) || !Forbids(row.interlock, command)) continue;
    std::string mend = "remove the cause";
    if (row.latched && Forbids(row.interlock, AxisCommand::home))
      mend += ", acknowledge it (scanstation device motion acknowledge)";
    if (row.alarm == Alarm::invalid) mend += ", then home the stage";
    return DeviceFault("interlock: " + std::string(row.name), "stage", std::move(mend));
  }
  return {};
}

}  // namespace scan
