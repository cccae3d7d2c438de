// The seam to tethered still cameras: what the PTP camera asks of libgphoto2, or of its twin.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace scan {

enum class PhotoFaultKind {
  gone,           // unplugged or switched off
  claimed,        // another program holds it
  not_permitted,  // this user may not open it
  busy,           // try again a little later
  timeout,        // it does not answer
  unsupported,    // the camera cannot do it
  no_space,       // card or memory full
  refused,        // the camera can, but did not (no focus, cover open, wrong value)
  transfer        // the connection is broken
};

struct PhotoFault {
  PhotoFaultKind kind = PhotoFaultKind::transfer;
  std::string what;  // call and reason
};

template <class T>
using PhotoResult = tl::expected<T, PhotoFault>;
using PhotoStatus = PhotoResult<void>;

// One camera as the system lists it, before it is opened.
struct PhotoDevice {
  std::string model;   // as the library calls it
  std::string port;    // where it is plugged in: "1-2.3", the same after every start
  std::string serial;  // as the USB device states it, may be empty
  std::string usb_id;  // vendor:product
  std::string handle;  // of the system, of this plugging only
  friend bool operator==(const PhotoDevice&, const PhotoDevice&) = default;
};

struct PhotoAbilities {
  bool capture = false;   // Capture works
  bool trigger = false;   // Trigger works
  bool settings = false;  // Get and Set work
  bool deletes = false;   // Delete works
  friend bool operator==(const PhotoAbilities&, const PhotoAbilities&) = default;
};

// One entry of the camera's menu, its value as text.
struct PhotoSetting {
  std::string name, label;
  std::string value;
  std::vector<std::string> choices;  // empty where it is no choice
  bool read_only = false;
  friend bool operator==(const PhotoSetting&, const PhotoSetting&) = default;
};

struct PhotoFile {
  std::string folder, name;
  friend bool operator==(const PhotoFile&, const PhotoFile&) = default;
};

enum class PhotoEventKind { none, file_added, capture_complete, other };

struct PhotoEvent {
  PhotoEventKind kind = PhotoEventKind::none;
  PhotoFile file;  // of file_added
  std::string text;
};

// Of one card; negative: not reported.
struct PhotoStorage {
  std::string label;
  bool writable = true;
  std::int64_t free_kb = -1;
  std::int64_t free_images = -1;
};

// An open camera; closed when it dies. Thread contract: one thread at a time. A call may take as
// long as the camera does: whoever cannot wait keeps it in a process of its own.
class PhotoCamera {
 public:
  virtual ~PhotoCamera() = default;
  virtual PhotoAbilities Abilities() = 0;
  virtual PhotoResult<std::vector<std::string>> SettingNames() = 0;
  virtual PhotoResult<PhotoSetting> Get(const std::string& name) = 0;
  // What the camera made of it is known by Get alone.
  virtual PhotoStatus Set(const std::string& name, const std::string& value) = 0;
  // Releases the shutter and returns; the files come as events.
  virtual PhotoStatus Trigger() = 0;
  // Releases the shutter and waits for a file; further ones come as events or not at all.
  virtual PhotoResult<PhotoFile> Capture() = 0;
  // The next event; kind none when there was none for so long.
  virtual PhotoResult<PhotoEvent> WaitEvent(int timeout_ms) = 0;
  virtual PhotoResult<std::vector<std::string>> FilesIn(const std::string& folder) = 0;
  virtual PhotoResult<std::vector<std::byte>> Download(const PhotoFile& file) = 0;
  virtual PhotoStatus Delete(const PhotoFile& file) = 0;
  virtual PhotoResult<std::vector<PhotoStorage>> Storage() = 0;
};

class PhotoSystem {
 public:
  virtual ~PhotoSystem() = default;
  virtual PhotoResult<std::vector<PhotoDevice>> List() = 0;  // by port
  virtual PhotoResult<std::unique_ptr<PhotoCamera>> Open(const PhotoDevice& device) = 0;
  // Other programs of this machine that hold the camera or take any that they see, with their
  // process ids, for people: "gvfsd-gphoto2 (812)".
  virtual std::vector<std::string> Competitors(const PhotoDevice& device) = 0;
};

}  // namespace scan
