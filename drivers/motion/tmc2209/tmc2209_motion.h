// A Motion on step lines whose drivers are TMC2209: set up at start, asked after every motion.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "drivers/motion/motion.h"
#include "drivers/motion/step_port.h"
#include "drivers/motion/tmc2209/serial_port.h"
#include "drivers/motion/tmc2209/tmc2209_config.h"

namespace scan {

// Whether any axis has one.
bool HasTmc2209(const Tmc2209Config& turntable, const Tmc2209Config& lift);

// Errors: bad_input naming the key, of either axis, or for two axes on one address.
Status ValidateTmc2209s(const Tmc2209Config& turntable, const Tmc2209Config& lift);

// Makes the motion on its lines, with every axis' port wrapped.
using StepMotionMaker = std::function<Result<std::unique_ptr<Motion>>(const StepPortWrap&)>;

// Sets up the drivers before anything may move, and anew with every homing. After each homing and
// move it compares the drivers' microstep counters with the steps sent, modulo four full steps, and
// reads their flags. A difference finds pulses lost between the two, or made by noise; it does not
// see a rotor that slips. Lost pulses, a driver that has started anew, short circuit,
// overtemperature or undervoltage, or one that is silent: a fault, the motion is aborted, only
// homing clears it. A hot driver or an open load is a minor alarm. The sense in which a counter
// runs is learnt from the first motion that shows it.
// Errors: device; bad_input as ValidateTmc2209s.
Result<std::unique_ptr<Motion>> MakeTmc2209Motion(const Tmc2209Config& turntable,
                                                  const Tmc2209Config& lift,
                                                  const SerialOpener& open,
                                                  const StepMotionMaker& make);

}  // namespace scan
