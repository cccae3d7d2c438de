#include "acquisition/session/session_paths.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace scan {
namespace {

constexpr std::array<std::string_view, 3> kPlainExtensions = {"jpg", "png", "tif"};
constexpr std::array<std::string_view, 4> kRawExtensions = {"dng", "nef", "cr2", "arw"};

template <std::size_t N>
bool Contains(const std::array<std::string_view, N>& list, std::string_view text) {
  return std::find(list.begin(), list.end(), text) != list.end();
}

std::string Suffix(int retake) { return retake > 0 ? fmt::format("_r{}", retake) : ""; }

std::filesystem::path Derived(const std::filesystem::path& session, const char* folder,
                              const Photo& photo) {
  return session / "derived" / folder / (photo.path.stem().string() + ".png");
}

}  // namespace

std::string FramePath(const PlannedView& view, int slice, int retake, std::string_view extension) {
  const std::string slice_part = view.slices > 1 ? fmt::format("_{}", slice) : "";
  return fmt::format("frames/{}_{}{}{}.{}", view.id, view.camera, slice_part, Suffix(retake),
                     extension);
}

std::string PlatePath(PlateKind kind, const std::string& aim_id, const std::string& camera,
                      int retake, std::string_view extension) {
  const std::string end = fmt::format("{}{}.{}", camera, Suffix(retake), extension);
  switch (kind) {
    case PlateKind::background:
      return fmt::format("plates/background_{}_{}", aim_id, end);
    case PlateKind::flat:
      return "plates/flat_" + end;
    case PlateKind::chart:
      break;
  }
  return "plates/chart_" + end;
}

std::string RejectPath(const std::string& what, const std::string& camera, int number,
                       std::string_view extension) {
  return fmt::format("frames/rejected_{}_{}_{}.{}", what, camera, number, extension);
}

std::filesystem::path MaskPath(const std::filesystem::path& session, const Photo& photo) {
  return Derived(session, "masks", photo);
}

std::filesystem::path IgnorePath(const std::filesystem::path& session, const Photo& photo) {
  return Derived(session, "ignore", photo);
}

bool IsRawExtension(std::string_view extension) { return Contains(kRawExtensions, extension); }

bool IsPictureExtension(std::string_view extension) {
  return Contains(kPlainExtensions, extension) || IsRawExtension(extension);
}

}  // namespace scan
