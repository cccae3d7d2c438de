#include "firmware-host/cli/commands.h"

namespace scan {

void AddAllCommands(CommandSet& commands) {
#ifdef SCAN_RECONSTRUCTION
  AddDemo(commands);
#endif
  AddCapture(commands);
  AddResume(commands);
  AddStationControl(commands);
  AddReplay(commands);
  AddVerify(commands);
  CLI::App& device = commands.AddGroup(nullptr, "device", "Devices tried by hand");
  AddCameraDevices(commands, device);
  AddLibcameraDevices(commands, device);
  AddPtpDevices(commands, device);
  AddMotionDevices(commands, device);
  AddUsbDevices(commands, device);
  AddTmcDevices(commands, device);
  AddDoctor(commands);
#ifdef SCAN_IMPORT
  AddImport(commands);
#endif
#ifdef SCAN_RECONSTRUCTION
  AddSurface(commands);
  AddAtlas(commands);
  AddMasks(commands);
  AddPose(commands);
  AddTexture(commands);
  AddReconstruct(commands);
  AddEvaluate(commands);
#endif
}

}  // namespace scan
