// scanstation-camera-libcamera: one camera of libcamera, in a process of its own.
#include <fmt/format.h>

#include <cstdlib>

#include "drivers/base/clock.h"
#include "drivers/camera/libcamera/libcamera_format.h"
#include "drivers/camera/libcamera/real_libcamera.h"
#include "firmware-host/camera_worker/libcamera_options.h"
#include "firmware-host/camera_worker/serve_camera.h"

namespace scan {
namespace {

std::vector<std::string> DetailsOf(LibcameraSystem& system, const LibcameraEntry& entry) {
  std::vector<std::string> details;
  const auto device = system.Open(entry.id);
  if (!device) return {device.error().what};
  for (const auto& [role, name] : {std::pair{LibcameraRole::still, "still"},
                                   {LibcameraRole::viewfinder, "viewfinder"},
                                   {LibcameraRole::raw, "raw"}}) {
    for (const LibcameraOffer& offer : (*device)->Offers(role)) {
      std::string line = fmt::format("{} {}", name, offer.format);
      for (const auto& [w, h] : offer.sizes) line += fmt::format(" {}x{}", w, h);
      if (!FindLibcameraFormat(offer.format)) line += " (not understood)";
      details.push_back(std::move(line));
    }
  }
  for (const auto& [name, range] : (*device)->Controls())
    details.push_back(fmt::format("control {} {:g} to {:g}", name, range.min, range.max));
  return details;
}

CameraWorkerRole LibcameraRoleOf() {
  const auto system = MakeRealLibcamera();
  CameraWorkerRole role;
  role.open = [system](const std::string& text) -> Result<std::unique_ptr<Camera>> {
    SCAN_TRY(const LibcameraOptions options, LibcameraOptionsFrom(text));
    return LibcameraCamera::Open(options, system, std::make_shared<SystemClock>());
  };
  role.list = [system]() -> Result<std::vector<CameraListing>> {
    SCAN_TRY(const auto entries, system->List());
    std::vector<CameraListing> cameras;
    for (const LibcameraEntry& entry : entries)
      cameras.push_back({entry.id, entry.model, DetailsOf(*system, entry)});
    return cameras;
  };
  return role;
}

}  // namespace
}  // namespace scan

int main() {
  ::setenv("LIBCAMERA_LOG_LEVELS", "*:ERROR", /*overwrite=*/0);
  return scan::CameraWorkerMain(scan::LibcameraRoleOf(), scan::kLibcameraWorker);
}
