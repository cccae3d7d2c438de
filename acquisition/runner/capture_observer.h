// What a running capture tells the console and the command line.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace scan {

enum class CaptureState { starting, homing, plate, moving, grabbing, paused, ending };

std::string_view NameOf(CaptureState state);  // "homing" ...

struct CaptureProgress {
  CaptureState state = CaptureState::starting;
  std::string view;  // at work on this one; empty before the first
  std::size_t views_accepted = 0;
  std::size_t views_failed = 0;
  std::size_t view_count = 0;
  std::filesystem::path last_picture;  // absolute; empty before the first
  std::string message;                 // one line for people: what is done, or why a frame failed
};

// Thread contract: called from the capture's thread, never two calls at once; return soon.
class CaptureObserver {
 public:
  virtual ~CaptureObserver() = default;
  virtual void OnProgress(const CaptureProgress& progress) = 0;
};

}  // namespace scan
