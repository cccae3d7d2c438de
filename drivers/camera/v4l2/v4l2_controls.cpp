#include "drivers/camera/v4l2/v4l2_controls.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstring>

namespace scan {
namespace {

ControlType TypeOf(std::uint32_t type) {
  switch (type) {
    case V4L2_CTRL_TYPE_INTEGER:
      return ControlType::integer;
    case V4L2_CTRL_TYPE_BOOLEAN:
      return ControlType::boolean;
    case V4L2_CTRL_TYPE_MENU:
      return ControlType::menu;
    case V4L2_CTRL_TYPE_INTEGER_MENU:
      return ControlType::integer_menu;
    case V4L2_CTRL_TYPE_BITMASK:
      return ControlType::bitmask;
    case V4L2_CTRL_TYPE_INTEGER64:
      return ControlType::integer64;
    case V4L2_CTRL_TYPE_BUTTON:
      return ControlType::button;
    default:
      return ControlType::other;
  }
}

bool IsMenu(const V4l2Control& control) {
  return control.type == ControlType::menu || control.type == ControlType::integer_menu;
}

void ReadMenu(V4l2Device& device, V4l2Control& control) {
  for (std::int64_t index = control.min; index <= control.max && index < control.min + 1024;
       ++index) {
    v4l2_querymenu entry{};
    entry.id = control.id;
    entry.index = static_cast<std::uint32_t>(index);
    if (device.Try(VIDIOC_QUERYMENU, &entry) < 0) continue;  // menus have holes
    const std::int64_t number = entry.value;                 // packed: copied before use
    control.menu.push_back({index, control.type == ControlType::menu
                                       ? reinterpret_cast<const char*>(entry.name)
                                       : std::to_string(number)});
  }
}

v4l2_ext_controls OneControl(v4l2_ext_control& value) {
  v4l2_ext_controls controls{};
  controls.which = V4L2_CTRL_WHICH_CUR_VAL;
  controls.count = 1;
  controls.controls = &value;
  return controls;
}

std::string Choices(const V4l2Control& control) {
  if (control.read_only) return "it can only be read";
  if (control.type == ControlType::boolean) return "choose 0 or 1";
  if (!IsMenu(control))
    return fmt::format("choose a number from {} to {} in steps of {}", control.min, control.max,
                       control.step);
  std::string text = "choose one of:";
  for (const ControlMenuEntry& entry : control.menu)
    text += fmt::format(" {} ({});", entry.value, entry.name);
  return text;
}

bool Allowed(const V4l2Control& control, std::int64_t value) {
  if (IsMenu(control))
    return std::any_of(control.menu.begin(), control.menu.end(),
                       [&](const ControlMenuEntry& entry) { return entry.value == value; });
  if (control.type == ControlType::bitmask) return value >= 0 && (value & ~control.max) == 0;
  return control.type == ControlType::button || (value >= control.min && value <= control.max);
}

}  // namespace

std::string_view NameOf(ControlType type) {
  constexpr std::string_view names[] = {"integer", "boolean",   "menu",   "integer_menu",
                                        "bitmask", "integer64", "button", "other"};
  return names[static_cast<std::size_t>(type)];
}

std::string ControlNameOf(std::string_view title) {
  std::string name;
  for (const char c : title) {
    const auto u = static_cast<unsigned char>(c);
    if (std::isalnum(u))
      name += static_cast<char>(std::tolower(u));
    else if (!name.empty() && name.back() != '_')
      name += '_';
  }
  while (!name.empty() && name.back() == '_') name.pop_back();
  return name;
}

Result<std::vector<V4l2Control>> ListControls(V4l2Device& device) {
  std::vector<V4l2Control> controls;
  std::uint32_t last = 0;
  for (;;) {
    v4l2_query_ext_ctrl query{};
    query.id = last | V4L2_CTRL_FLAG_NEXT_CTRL;
    const int result = device.Try(VIDIOC_QUERY_EXT_CTRL, &query);
    if (result == -EINVAL || result == -ENOTTY) return controls;
    if (result < 0)
      return tl::unexpected(V4l2Error(-result, "VIDIOC_QUERY_EXT_CTRL", device.Where()));
    if (query.id <= last)
      return DeviceFault("the camera lists its controls in circles", device.Where(),
                         "replug the camera");
    last = query.id;
    V4l2Control control;
    control.id = query.id;
    control.title = std::string(query.name, strnlen(query.name, sizeof(query.name)));
    control.name = ControlNameOf(control.title);
    control.type = TypeOf(query.type);
    control.min = query.minimum;
    control.max = query.maximum;
    control.step = static_cast<std::int64_t>(query.step);
    control.default_value = query.default_value;
    control.read_only = (query.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0;
    control.inactive = (query.flags & V4L2_CTRL_FLAG_INACTIVE) != 0;
    if ((query.flags & V4L2_CTRL_FLAG_DISABLED) || control.type == ControlType::other) continue;
    if (IsMenu(control)) ReadMenu(device, control);
    controls.push_back(std::move(control));
  }
}

const V4l2Control* FindControl(const std::vector<V4l2Control>& controls, std::string_view name) {
  const auto found = std::find_if(controls.begin(), controls.end(),
                                  [&](const V4l2Control& c) { return c.name == name; });
  return found == controls.end() ? nullptr : &*found;
}

const V4l2Control* FindControl(const std::vector<V4l2Control>& controls, std::uint32_t id) {
  const auto found = std::find_if(controls.begin(), controls.end(),
                                  [&](const V4l2Control& c) { return c.id == id; });
  return found == controls.end() ? nullptr : &*found;
}

Result<std::int64_t> ReadControl(V4l2Device& device, const V4l2Control& control) {
  v4l2_ext_control value{};
  value.id = control.id;
  v4l2_ext_controls controls = OneControl(value);
  SCAN_CHECK(device.Call(VIDIOC_G_EXT_CTRLS, "reading " + control.name, &controls));
  if (control.type == ControlType::integer64) return std::int64_t{value.value64};  // packed: copied
  if (control.type == ControlType::bitmask)
    return std::int64_t{static_cast<std::uint32_t>(value.value)};
  return std::int64_t{value.value};
}

Result<std::int64_t> WriteControl(V4l2Device& device, const V4l2Control& control,
                                  std::int64_t value) {
  const std::string where = device.Where() + ", control " + control.name;
  if (control.read_only || !Allowed(control, value))
    return BadInput(fmt::format("{} cannot be {}", control.name, value), where, Choices(control));
  v4l2_ext_control field{};
  field.id = control.id;
  if (control.type == ControlType::integer64)
    field.value64 = value;
  else
    field.value = static_cast<std::int32_t>(value);
  v4l2_ext_controls controls = OneControl(field);
  SCAN_CHECK(device.Call(VIDIOC_S_EXT_CTRLS, fmt::format("setting {} to {}", control.name, value),
                         &controls));
  if (control.type == ControlType::button) return value;
  return ReadControl(device, control);
}

Result<std::int64_t> ParseControlValue(const V4l2Control& control, std::string_view text) {
  std::int64_t value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool number = code == std::errc() && end == text.data() + text.size();
  // The numbers of an integer menu are its names: 400 is an ISO speed, not the 400th entry.
  if (IsMenu(control)) {
    for (const ControlMenuEntry& entry : control.menu)
      if (entry.name == text || ControlNameOf(entry.name) == text) return entry.value;
  }
  if (number) return value;
  if (control.type == ControlType::boolean && (text == "true" || text == "false"))
    return text == "true" ? 1 : 0;
  return BadInput(fmt::format("'{}' is no value of {}", text, control.name), control.name,
                  Choices(control));
}

std::string ControlValueText(const V4l2Control& control, std::int64_t value) {
  for (const ControlMenuEntry& entry : control.menu)
    if (entry.value == value) return fmt::format("{} ({})", value, entry.name);
  return std::to_string(value);
}

}  // namespace scan
