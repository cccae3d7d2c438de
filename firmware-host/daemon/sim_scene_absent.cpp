#include "firmware-host/daemon/sim_scene.h"

namespace scan {

Result<SimScene> MakeSimScene(const std::string& specimen) {
  return BadInput("this build has no synthetic specimens", "sim.specimen = " + specimen,
                  "build with -DSCAN_RECONSTRUCTION=ON");
}

}  // namespace scan
