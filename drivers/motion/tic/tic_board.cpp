#include "drivers/motion/tic/tic_board.h"

#include <fmt/format.h>

namespace scan {

Status TicBoard::Open() {
  if (device_) return {};
  SCAN_TRY(const auto devices, bus_->List());
  SCAN_TRY(const UsbIdentity found,
           FindUsb(devices, TicSelector(wiring_.port, wiring_.serial), "Tic board"));
  if (found.release < kTicLeastFirmware) {
    return DeviceFault(fmt::format("firmware {:x}.{:02x} knows no limit switches and no homing",
                                   found.release >> 8, found.release & 0xff),
                       Describe(found),
                       "upgrade it to 1.06 or later (Pololu's guide, section 5.7)");
  }
  SCAN_TRY(device_, bus_->Open(found));
  identity_ = found;
  return {};
}

// A board that failed once is not trusted to have understood anything since.
Status TicBoard::Seen(Status status) {
  if (!status) device_.reset();
  return status;
}

Status TicBoard::Send(TicCommand command, std::int32_t value) {
  SCAN_CHECK(Open());
  return Seen(device_->Write(EncodeTic(command, value), {}));
}

Result<TicVariables> TicBoard::ReadVariables() {
  SCAN_CHECK(Open());
  TicVariablesBlock block{};
  SCAN_CHECK(Seen(device_->Read(EncodeTicRead(TicCommand::get_variable, 0), block)));
  return DecodeTicVariables(block);
}

Result<TicSettingsBlock> TicBoard::ReadSettingsBlock() {
  SCAN_CHECK(Open());
  TicSettingsBlock block{};
  SCAN_CHECK(
      Seen(device_->Read(EncodeTicRead(TicCommand::get_setting, 1), std::span(block).subspan(1))));
  return block;
}

Result<TicSettings> TicBoard::ReadSettings() {
  SCAN_TRY(const TicSettingsBlock block, ReadSettingsBlock());
  return DecodeTicSettings(block);
}

Result<bool> TicBoard::WriteSettings(const TicSettings& wanted) {
  SCAN_TRY(const TicSettingsBlock before, ReadSettingsBlock());
  TicSettingsBlock after = before;
  EncodeTicSettings(wanted, after);
  if (after == before) return false;
  for (std::size_t k = 1; k < after.size(); ++k) {
    if (after[k] == before[k]) continue;
    SCAN_CHECK(Seen(device_->Write(
        EncodeTicSetting(static_cast<std::uint8_t>(k), std::to_integer<std::uint8_t>(after[k])),
        {})));
  }
  SCAN_CHECK(Send(TicCommand::reinitialize));
  SCAN_TRY(const TicSettingsBlock kept, ReadSettingsBlock());
  if (kept == after) return true;
  return DeviceFault("it did not keep its new settings", Describe(identity_),
                     "set them with Pololu's Tic Control Center: homing speeds, command timeout, "
                     "soft error response 'Decelerate to hold'");
}

}  // namespace scan
