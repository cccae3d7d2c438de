// The files of one exposure, checked.
#pragma once

#include <string>
#include <vector>

#include "drivers/base/result.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/ptp/photo_system.h"

namespace scan {

// "jpg", "nef" ... of a file's name. Errors: device, for what is no picture that a session keeps.
Result<std::string> PictureExtension(const PhotoFile& file, const std::string& where);

// Whether these may be the files of one exposure: kinds differ; names too differ only in their
// extension, unless libgphoto2 made them up (captNNNN, of pictures that never were on a card).
Status CheckOneExposure(const std::vector<PhotoFile>& files, const std::string& where);

// Looks at the structure, decodes nothing: a JPEG is whole and of this size (0: any), a raw file
// begins as one. Errors: device.
Status CheckPicture(const EncodedFile& file, int w, int h, const std::string& where);

}  // namespace scan
