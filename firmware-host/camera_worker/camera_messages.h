// A camera over the wire: the protocol between a camera worker and its owner.
//   {"id":1,"call":"open","beat_ms":500,"params":{"options":"…"}}   answers the camera's info
//   {"id":2,"call":"configure","beat_ms":500,"params":{"exposure_us":8000}}
//   {"id":3,"call":"grab","beat_ms":500,"params":{}}     answers a frame; its bytes in descriptors
//   {"id":4,"call":"list",…}                              answers the cameras that are there
//   {"cancel":3}                                          from the owner, at any time
//   {"beat":3}                                            from the worker, while it works at 3
//   {"id":3,"ok":{}} or {"id":3,"error":{"kind","what","where","mend"}}
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "drivers/base/result.h"
#include "drivers/camera/camera.h"
#include "firmware-host/camera_worker/camera_listing.h"
#include "firmware-host/camera_worker/worker_link.h"

namespace scan {

nlohmann::json ToJson(const CameraInfo& info);
nlohmann::json ToJson(const CameraSettings& settings);
nlohmann::json ToJson(const AppliedSettings& applied);
nlohmann::json ToJson(const std::vector<CameraListing>& cameras);

// What arrives is checked whole: types, ranges, lengths. Errors: bad_input naming the message.
Result<CameraInfo> CameraInfoFromJson(const nlohmann::json& json);
Result<CameraSettings> CameraSettingsFromJson(const nlohmann::json& json);
Result<AppliedSettings> AppliedSettingsFromJson(const nlohmann::json& json);
Result<std::vector<CameraListing>> CameraListingsFromJson(const nlohmann::json& json);

// The frame's bytes are put into sealed memory files (one copy) that the message carries.
// Errors: failed, when there is no memory or the frame has more files than a message can carry.
Result<WorkerMessage> PackFrame(const Frame& frame);

// Reads them out of the memory files (one more copy). A descriptor that is no sealed memory file,
// or not of the length stated, is refused, so that reading can neither wait nor fail half way.
// Errors: bad_input naming what is wrong.
Result<Frame> UnpackFrame(const nlohmann::json& body, const std::vector<UniqueFd>& files,
                          std::uint64_t max_bytes);

}  // namespace scan
