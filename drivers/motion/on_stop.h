// What holds an axis once it has stopped.
#pragma once

namespace scan {

enum class OnStop { release, hold, brake };

}  // namespace scan
