// Where things lie in a session folder.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "acquisition/session/log_document.h"
#include "acquisition/session/photo_set.h"

namespace scan {

inline constexpr const char* kSessionFile = "session.json";
inline constexpr const char* kLogFile = "log.jsonl";

// frames/VIEW_CAMERA[_SLICE][_rN].EXT, relative: the slice where the view has several, rN for the
// N-th retake (pictures are never overwritten). Documents name the path; readers never take it
// apart.
std::string FramePath(const PlannedView& view, int slice, int retake, std::string_view extension);

// plates/background_AIM_CAMERA[_rN].EXT, flat_CAMERA, chart_CAMERA, relative.
std::string PlatePath(PlateKind kind, const std::string& aim_id, const std::string& camera,
                      int retake, std::string_view extension);

// frames/rejected_WHAT_CAMERA_N.EXT, relative: WHAT is the view, or the aim of a plate.
std::string RejectPath(const std::string& what, const std::string& camera, int number,
                       std::string_view extension);

// derived/masks/NAME.png, absolute; NAME is VIEW_CAMERA (with _rN for a retake).
std::filesystem::path MaskPath(const std::filesystem::path& session, const Photo& photo);
std::filesystem::path IgnorePath(const std::filesystem::path& session, const Photo& photo);

// jpg png tif dng nef cr2 arw
bool IsPictureExtension(std::string_view extension);
bool IsRawExtension(std::string_view extension);

}  // namespace scan
