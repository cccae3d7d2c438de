#include "firmware-host/devices/open_libcamera.h"

#include <charconv>
#include <optional>

#include "firmware-host/camera_worker/libcamera_options.h"
#include "firmware-host/devices/worker_recovery.h"

namespace scan {
namespace {

CameraWorkerLauncher Launcher() { return WorkerProgram(WorkerProgramPath(kLibcameraWorker)); }

// libcamera's id of a UVC camera ends with its vendor and product: "...-1:1.0-046d:0825".
std::optional<UsbSelector> UsbDeviceIn(const std::string& id) {
  if (id.size() < 10 || id[id.size() - 10] != '-' || id[id.size() - 5] != ':') return {};
  const char* text = id.data() + id.size() - 9;
  UsbSelector selector;
  std::uint16_t product = 0;
  const auto vendor = std::from_chars(text, text + 4, selector.vendor, 16);
  const auto second = std::from_chars(text + 5, text + 9, product, 16);
  if (vendor.ptr != text + 4 || second.ptr != text + 9) return {};
  selector.products = {product};
  return selector;
}

}  // namespace

Result<std::unique_ptr<Camera>> OpenLibcamera(const LibcameraOptions& options) {
  WorkerCameraOptions worker;
  worker.id = options.id;
  worker.options = ToWorkerOptions(options);
  LibcameraOptions first = options;
  first.config.reconnect_ms = 0;
  worker.first_options = ToWorkerOptions(first);
  // The driver's own limits come first: they say more about what is wrong.
  worker.limits.open += WholeMs(options.config.reconnect_ms);
  worker.limits.configure += WholeMs(options.config.reconnect_ms);
  worker.limits.grab += WholeMs(options.config.reconnect_ms + 5 * options.config.timeout_ms);
  if (const auto usb = UsbDeviceIn(options.config.camera))
    worker.on_hang = [usb] { return ResetUsbCamera(*usb); };
  return WorkerCamera::Open(std::move(worker), Launcher());
}

Result<std::vector<CameraListing>> ListLibcameras() { return ListWorkerCameras(Launcher()); }

}  // namespace scan
