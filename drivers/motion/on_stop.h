// What holds an axis once it has stopped.
#pragma once

#include <string_view>

namespace scan {

enum class OnStop { release, hold, brake };

constexpr std::string_view NameOf(OnStop on_stop) {
  return on_stop == OnStop::release ? "release" : on_stop == OnStop::hold ? "hold" : "brake";
}

}  // namespace scan
