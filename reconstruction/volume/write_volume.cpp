#include "reconstruction/volume/write_volume.h"

#include <itkImage.h>
#include <itkImageFileWriter.h>
#include <itkMetaImageIO.h>
#include <itkNrrdImageIO.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace scan {
namespace {

namespace fs = std::filesystem;

template <class Pixel>
Pixel Converted(float grey) {
  if constexpr (std::is_floating_point_v<Pixel>) {
    return grey;
  } else {
    const float top = std::numeric_limits<Pixel>::max();
    return static_cast<Pixel>(std::lround(std::clamp(grey, 0.0f, top)));
  }
}

template <class Pixel>
void Write(const fs::path& path, const Volume& volume, bool compressed, itk::ImageIOBase* io) {
  using Image = itk::Image<Pixel, 3>;
  auto image = Image::New();
  typename Image::SizeType size;
  typename Image::SpacingType spacing;
  typename Image::PointType origin;
  typename Image::DirectionType direction;
  for (unsigned a = 0; a < 3; ++a) {
    size[a] = volume.size[a];
    spacing[a] = volume.spacing_mm[a];
    origin[a] = volume.origin_mm[a];
    for (unsigned b = 0; b < 3; ++b) direction[a][b] = volume.direction(a, b);
  }
  image->SetRegions(size);
  image->SetSpacing(spacing);
  image->SetOrigin(origin);
  image->SetDirection(direction);
  image->Allocate();
  std::transform(volume.grey.begin(), volume.grey.end(), image->GetBufferPointer(),
                 Converted<Pixel>);
  auto writer = itk::ImageFileWriter<Image>::New();
  writer->SetImageIO(io);
  writer->SetInput(image);
  writer->SetFileName(path.string());
  writer->SetUseCompression(compressed);
  // Level 9, the default, takes ten times as long for 5 % less.
  io->SetCompressionLevel(2);
  writer->Update();
}

}  // namespace

Status WriteVolume(const fs::path& path, const Volume& volume, const WriteVolumeOptions& options) {
  if (volume.voxels() == 0 || volume.grey.size() != volume.voxels())
    return BadInput("the volume is empty", path.string(), "write one that holds voxels");
  const std::string extension = path.extension().string();
  itk::ImageIOBase::Pointer io;
  if (extension == ".mha") io = itk::MetaImageIO::New().GetPointer();
  if (extension == ".nrrd") io = itk::NrrdImageIO::New().GetPointer();
  if (!io) return BadInput("volumes are written as .mha or .nrrd", path.string(), "rename it");
  // The extension must stay last: the writers choose the layout by it.
  fs::path beside = path;
  beside.replace_filename("." + path.stem().string() + ".part" + extension);
  std::error_code code;
  try {
    switch (options.type) {
      case GreyType::uint8:
        Write<std::uint8_t>(beside, volume, options.compressed, io);
        break;
      case GreyType::uint16:
        Write<std::uint16_t>(beside, volume, options.compressed, io);
        break;
      case GreyType::float32:
        Write<float>(beside, volume, options.compressed, io);
        break;
    }
    fs::rename(beside, path);
  } catch (const std::exception& e) {
    fs::remove(beside, code);
    std::string why = e.what();
    std::replace(why.begin(), why.end(), '\n', ' ');
    return Failed("the volume cannot be written (" + why + ")", path.string(),
                  "check the folder, its rights and the free space");
  }
  return {};
}

}  // namespace scan
