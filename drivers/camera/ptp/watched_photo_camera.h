// Notes whether any call found the connection to a camera broken.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/camera/ptp/photo_system.h"

namespace scan {

class WatchedPhotoCamera final : public PhotoCamera {
 public:
  explicit WatchedPhotoCamera(std::unique_ptr<PhotoCamera> camera) : camera_(std::move(camera)) {}

  bool broken() const { return broken_; }

  PhotoAbilities Abilities() override { return camera_->Abilities(); }
  PhotoResult<std::vector<std::string>> SettingNames() override {
    return Note(camera_->SettingNames());
  }
  PhotoResult<PhotoSetting> Get(const std::string& name) override {
    return Note(camera_->Get(name));
  }
  PhotoStatus Set(const std::string& name, const std::string& value) override {
    return Note(camera_->Set(name, value));
  }
  PhotoStatus Trigger() override { return Note(camera_->Trigger()); }
  PhotoResult<PhotoFile> Capture() override { return Note(camera_->Capture()); }
  PhotoResult<PhotoEvent> WaitEvent(int timeout_ms) override {
    return Note(camera_->WaitEvent(timeout_ms));
  }
  PhotoResult<std::vector<std::string>> FilesIn(const std::string& folder) override {
    return Note(camera_->FilesIn(folder));
  }
  PhotoResult<std::vector<std::byte>> Download(const PhotoFile& file) override {
    return Note(camera_->Download(file));
  }
  PhotoStatus Delete(const PhotoFile& file) override { return Note(camera_->Delete(file)); }
  PhotoResult<std::vector<PhotoStorage>> Storage() override { return Note(camera_->Storage()); }

 private:
  template <class T>
  PhotoResult<T> Note(PhotoResult<T> result) {
    if (!result) {
      const PhotoFaultKind kind = result.error().kind;
      broken_ = broken_ || kind == PhotoFaultKind::gone || kind == PhotoFaultKind::timeout ||
                kind == PhotoFaultKind::transfer;
    }
    return result;
  }

  std::unique_ptr<PhotoCamera> camera_;
  bool broken_ = false;
};

}  // namespace scan
