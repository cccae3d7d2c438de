// One line on the terminal: stage, share done, elapsed and remaining time.
#pragma once

#include "drivers/base/progress.h"

namespace scan {

// Writes to standard error when it is a terminal; otherwise does nothing.
ProgressFn MakeTerminalProgress();

// Ends the line that progress left open, if any.
void EndTerminalProgress();

}  // namespace scan
