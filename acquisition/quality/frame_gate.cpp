#include "acquisition/quality/frame_gate.h"

#include <fmt/format.h>

#include <cmath>

#include "acquisition/quality/picture_check.h"
#include "drivers/base/sha256.h"

namespace scan {
namespace {

std::optional<Rejection> FindOtherSetting(std::string_view name, const std::optional<double>& asked,
                                          const std::optional<double>& applied,
                                          double tolerance_rel) {
  if (!asked || !applied) return std::nullopt;
  if (std::abs(*applied - *asked) <= tolerance_rel * std::abs(*asked)) return std::nullopt;
  return Rejection{RejectCause::settings,
                   fmt::format("{} is {:g}, asked for {:g}", name, *applied, *asked)};
}

std::optional<Rejection> FindPictureRejection(const Frame& frame, const FrameDemand& demand) {
  if (frame.files.empty())
    return Rejection{RejectCause::no_picture, "the camera gave no picture file"};
  for (const EncodedFile& file : frame.files) {
    std::optional<PictureSize> size;
    if (const auto fault = FindPictureFault(file.extension, file.bytes, size))
      return Rejection{RejectCause::unreadable, *fault};
    if (size && *size != PictureSize{demand.w, demand.h})
      return Rejection{RejectCause::wrong_size,
                       fmt::format("the {} is {} x {}, expected {} x {}", file.extension, size->w,
                                   size->h, demand.w, demand.h)};
  }
  return std::nullopt;
}

}  // namespace

std::string_view NameOf(RejectCause cause) {
  switch (cause) {
    case RejectCause::before_settled:
      return "before_settled";
    case RejectCause::settings:
      return "settings";
    case RejectCause::no_picture:
      return "no_picture";
    case RejectCause::unreadable:
      return "unreadable";
    case RejectCause::wrong_size:
      return "wrong_size";
    case RejectCause::duplicate:
      return "duplicate";
  }
  return "unreadable";
}

FrameIdentity IdentityOf(const Frame& frame) {
  FrameIdentity identity{frame.sensor_sequence, {}};
  for (const EncodedFile& file : frame.files) identity.sha256.push_back(Sha256Hex(file.bytes));
  return identity;
}

std::optional<Rejection> FindRejection(const Frame& frame, const FrameIdentity& identity,
                                       const FrameDemand& demand) {
  if (frame.exposure.not_before_ns < demand.settled_mono_ns)
    return Rejection{RejectCause::before_settled,
                     fmt::format("the exposure may have begun {:.3f} ms before the axes settled",
                                 1e-6 * static_cast<double>(demand.settled_mono_ns -
                                                            frame.exposure.not_before_ns))};
  if (auto other = FindOtherSetting("exposure_us", demand.asked.exposure_us,
                                    frame.applied.exposure_us, demand.settings_tolerance_rel))
    return other;
  if (auto other = FindOtherSetting("gain", demand.asked.gain, frame.applied.gain,
                                    demand.settings_tolerance_rel))
    return other;
  if (demand.last && demand.last->sensor_sequence == identity.sensor_sequence)
    return Rejection{RejectCause::duplicate, fmt::format("sensor sequence {} was delivered before",
                                                         identity.sensor_sequence)};
  if (demand.last && !identity.sha256.empty() && demand.last->sha256 == identity.sha256)
    return Rejection{RejectCause::duplicate, "the picture is byte for byte the one before"};
  return FindPictureRejection(frame, demand);
}

}  // namespace scan
