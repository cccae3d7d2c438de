// The controls of a camera by name: listed, read, set and read back.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/base/result.h"
#include "drivers/camera/v4l2/v4l2_device.h"

namespace scan {

enum class ControlType { integer, boolean, menu, integer_menu, bitmask, integer64, button, other };
std::string_view NameOf(ControlType type);

struct ControlMenuEntry {
  std::int64_t value = 0;
  std::string name;  // of an integer menu: its number
  friend bool operator==(const ControlMenuEntry&, const ControlMenuEntry&) = default;
};

struct V4l2Control {
  std::uint32_t id = 0;
  std::string name;   // white_balance_automatic, as v4l2-ctl prints it
  std::string title;  // as the driver words it
  ControlType type = ControlType::integer;
  std::int64_t min = 0, max = 0, step = 1, default_value = 0;
  std::vector<ControlMenuEntry> menu;
  bool read_only = false;
  bool inactive = false;  // governed by an automatic that is on; may change with other controls
};

// Lower case letters and digits, every run of others one underscore.
std::string ControlNameOf(std::string_view title);

// Every control of a kind above that is not disabled, in the driver's order. Errors: device.
Result<std::vector<V4l2Control>> ListControls(V4l2Device& device);
const V4l2Control* FindControl(const std::vector<V4l2Control>& controls, std::string_view name);
const V4l2Control* FindControl(const std::vector<V4l2Control>& controls, std::uint32_t id);

Result<std::int64_t> ReadControl(V4l2Device& device, const V4l2Control& control);

// Sets the value and gives what the device made of it (it may round to its own steps).
// Errors: bad_input out of range, for a menu entry that does not exist and for a read-only control;
// device when the call fails.
Result<std::int64_t> WriteControl(V4l2Device& device, const V4l2Control& control,
                                  std::int64_t value);

// A number, true, false, or the name of a menu entry (as shown or as its lower-case name).
// Errors: bad_input with the choices.
Result<std::int64_t> ParseControlValue(const V4l2Control& control, std::string_view text);

// For people: the menu entry's name where there is one.
std::string ControlValueText(const V4l2Control& control, std::int64_t value);

}  // namespace scan
