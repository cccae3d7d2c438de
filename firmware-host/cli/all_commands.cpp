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
  AddImport(commands);
  AddCameraDevices(commands);
  AddMotionDevices(commands);
  AddDoctor(commands);
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
