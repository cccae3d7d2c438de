#include "firmware-host/daemon/sim_scene.h"

#include <memory>

#include "reconstruction/specimens/photograph.h"

namespace scan {

Result<SimScene> MakeSimScene(const std::string& specimen) {
  SCAN_TRY(std::unique_ptr<Specimen> made, MakeSpecimen(specimen));
  SimScene scene;
  scene.specimen_bounds = made->Bounds();
  const auto photographed = std::make_shared<const PhotographScene>(
      MakePhotographScene(std::shared_ptr<const Specimen>(std::move(made))));
  scene.renderer = [photographed](const TrueState& state) -> Result<cv::Mat> {
    return RenderPhotograph(
        *photographed, state.camera_from_model, state.intrinsics,
        {.specimen_present = state.specimen_present, .light_on = state.light_on});
  };
  return scene;
}

}  // namespace scan
