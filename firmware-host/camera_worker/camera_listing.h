// What a worker program says of the cameras that it finds.
#pragma once

#include <string>
#include <vector>

namespace scan {

// A camera that a worker program can open.
struct CameraListing {
  std::string id;                    // as the camera's library calls it: what `options` may name
  std::string model;                 // for people
  std::vector<std::string> details;  // sizes, port, battery, ..., one a line
  friend bool operator==(const CameraListing&, const CameraListing&) = default;
};

}  // namespace scan
