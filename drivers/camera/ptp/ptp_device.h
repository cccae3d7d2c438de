// Which camera is meant, whether it is fit for a run, and its faults in words.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "drivers/base/result.h"
#include "drivers/camera/ptp/photo_system.h"
#include "drivers/camera/ptp/ptp_config.h"

namespace scan {

// "Nikon DSC D850 at port 1-2.3"
std::string Describe(const PhotoDevice& device);

// The error of a call, with what to do about it. `competitors`: PhotoSystem::Competitors.
Error PtpError(const PhotoFault& fault, const std::string& where,
               std::span<const std::string> competitors = {});

// The only camera that fits port, serial and model. Errors: device when there is none; bad_input
// when there are several.
Result<PhotoDevice> FindPhotoDevice(std::span<const PhotoDevice> devices, const PtpConfig& config);

// Opens it and checks what it is able to do. Errors: device, naming the program that holds it.
Result<std::unique_ptr<PhotoCamera>> OpenPhotoDevice(PhotoSystem& system,
                                                     const PhotoDevice& device);

// What a camera reports of its state; negative: not reported.
struct PtpReadiness {
  double battery_percent = -1;
  std::int64_t shots_left = -1;  // on its card
};

// Errors: device, when a call fails.
Result<PtpReadiness> ReadReadiness(PhotoCamera& camera, const std::string& where);

// What stands against beginning a run, or nothing. `onto_card`: the pictures stay on the card.
Status CheckReadiness(const PtpReadiness& readiness, const PtpConfig& config, bool onto_card,
                      const std::string& where);

}  // namespace scan
