// Every subcommand of scanstation, one function each in a file of its own group.
#pragma once

#include "firmware-host/cli/command.h"

namespace scan {

void AddAllCommands(CommandSet& commands);

// station_commands.cpp: clients of scanstationd
void AddCapture(CommandSet& commands);
void AddResume(CommandSet& commands);
void AddStationControl(CommandSet& commands);  // confirm status stop pause continue

// motion_commands.cpp: device motion ..., device light, device gpio ...
void AddMotionDevices(CommandSet& commands, CLI::App& device);

// usb_commands.cpp: device usb ..., device tic ...
void AddUsbDevices(CommandSet& commands, CLI::App& device);

// tmc2209_commands.cpp: device tmc2209 ...
void AddTmcDevices(CommandSet& commands, CLI::App& device);

// doctor_command.cpp
void AddDoctor(CommandSet& commands);

// device_commands.cpp: device camera list|grab|controls|set
void AddCameraDevices(CommandSet& commands, CLI::App& device);

// libcamera_commands.cpp
void AddLibcameraDevices(CommandSet& commands, CLI::App& device);

// ptp_commands.cpp: device ptp list|info|get|set|grab
void AddPtpDevices(CommandSet& commands, CLI::App& device);

// session_commands.cpp
void AddReplay(CommandSet& commands);
void AddVerify(CommandSet& commands);

// import_command.cpp
void AddImport(CommandSet& commands);

// model_commands.cpp
void AddSurface(CommandSet& commands);
void AddAtlas(CommandSet& commands);
void AddMasks(CommandSet& commands);
void AddPose(CommandSet& commands);
void AddTexture(CommandSet& commands);
void AddReconstruct(CommandSet& commands);

// demo_command.cpp
void AddDemo(CommandSet& commands);

// evaluate_command.cpp
void AddEvaluate(CommandSet& commands);

}  // namespace scan
