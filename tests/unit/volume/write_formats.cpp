#include "tests/unit/volume/write_formats.h"

#include <fmt/format.h>
#include <itkGDCMImageIO.h>
#include <itkImage.h>
#include <itkImageFileWriter.h>
#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <itkPNGImageIO.h>
#include <itkRGBPixel.h>
#include <itkTIFFImageIO.h>

namespace scan {
namespace {

namespace fs = std::filesystem;

itk::ImageIOBase::Pointer IoFor(const fs::path& path) {
  const std::string e = path.extension().string();
  if (e == ".mha" || e == ".mhd") return itk::MetaImageIO::New().GetPointer();
  if (e == ".nrrd") return itk::NrrdImageIO::New().GetPointer();
  if (e == ".tif") return itk::TIFFImageIO::New().GetPointer();
  if (e == ".png") return itk::PNGImageIO::New().GetPointer();
  return itk::NiftiImageIO::New().GetPointer();
}

template <class Pixel>
void Write3(const fs::path& path, const Volume& volume) {
  using Image = itk::Image<Pixel, 3>;
  auto image = Image::New();
  typename Image::SizeType size;
  typename Image::DirectionType direction;
  for (unsigned a = 0; a < 3; ++a) {
    size[a] = volume.size[a];
    for (unsigned b = 0; b < 3; ++b) direction[a][b] = volume.direction(a, b);
  }
  image->SetRegions(size);
  image->SetSpacing(volume.spacing_mm.data());
  image->SetOrigin(volume.origin_mm.data());
  image->SetDirection(direction);
  image->Allocate();
  std::copy(volume.grey.begin(), volume.grey.end(), image->GetBufferPointer());
  auto writer = itk::ImageFileWriter<Image>::New();
  writer->SetImageIO(IoFor(path));
  writer->SetFileName(path.string());
  writer->SetInput(image);
  writer->Update();
}

template <class Pixel>
typename itk::Image<Pixel, 2>::Pointer SliceOf(const Volume& volume, std::size_t k) {
  using Image = itk::Image<Pixel, 2>;
  auto image = Image::New();
  image->SetRegions(typename Image::SizeType{{volume.size[0], volume.size[1]}});
  image->Allocate();
  const std::size_t n = volume.size[0] * volume.size[1];
  std::copy_n(volume.grey.begin() + static_cast<std::ptrdiff_t>(k * n), n,
              image->GetBufferPointer());
  return image;
}

}  // namespace

void WriteWithItk(const fs::path& path, const Volume& volume, Scalar scalar) {
  switch (scalar) {
    case Scalar::int8:
      return Write3<std::int8_t>(path, volume);
    case Scalar::uint8:
      return Write3<std::uint8_t>(path, volume);
    case Scalar::int16:
      return Write3<std::int16_t>(path, volume);
    case Scalar::uint16:
      return Write3<std::uint16_t>(path, volume);
    case Scalar::int32:
      return Write3<std::int32_t>(path, volume);
    case Scalar::uint32:
      return Write3<std::uint32_t>(path, volume);
    case Scalar::float32:
      return Write3<float>(path, volume);
    case Scalar::float64:
      return Write3<double>(path, volume);
  }
}

void WriteColour(const fs::path& path) {
  using Image = itk::Image<itk::RGBPixel<std::uint8_t>, 3>;
  auto image = Image::New();
  image->SetRegions(Image::SizeType{{4, 4, 4}});
  image->Allocate(true);
  auto writer = itk::ImageFileWriter<Image>::New();
  writer->SetImageIO(IoFor(path));
  writer->SetFileName(path.string());
  writer->SetInput(image);
  writer->Update();
}

void WriteSlices(const fs::path& folder, const Volume& volume, const std::string& extension) {
  fs::create_directories(folder);
  for (std::size_t k = 0; k < volume.size[2]; ++k) {
    auto writer = itk::ImageFileWriter<itk::Image<std::uint8_t, 2>>::New();
    const fs::path path = folder / fmt::format("slice_{}{}", k, extension);
    writer->SetImageIO(IoFor(path));
    writer->SetFileName(path.string());
    writer->SetInput(SliceOf<std::uint8_t>(volume, k));
    writer->Update();
  }
}

void WriteDicom(const fs::path& folder, const Volume& volume) {
  fs::create_directories(folder);
  auto io = itk::GDCMImageIO::New();
  io->KeepOriginalUIDOn();
  for (std::size_t k = 0; k < volume.size[2]; ++k) {
    auto image = SliceOf<std::int16_t>(volume, k);
    const double spacing[2] = {volume.spacing_mm[0], volume.spacing_mm[1]};
    image->SetSpacing(spacing);
    auto& tags = image->GetMetaDataDictionary();
    const auto tag = [&](const char* key, const std::string& value) {
      itk::EncapsulateMetaData<std::string>(tags, key, value);
    };
    tag("0008|0016", "1.2.840.10008.5.1.4.1.1.2");
    tag("0008|0018", fmt::format("1.2.826.0.1.3680043.2.1125.3.{}", k + 1));
    tag("0008|0060", "CT");
    tag("0020|000d", "1.2.826.0.1.3680043.2.1125.1");
    tag("0020|000e", "1.2.826.0.1.3680043.2.1125.2");
    tag("0020|0013", fmt::format("{}", k + 1));
    const Eigen::Vector3d at =
        volume.origin_mm + volume.direction.col(2) * volume.spacing_mm[2] * static_cast<double>(k);
    tag("0020|0032", fmt::format("{}\\{}\\{}", at.x(), at.y(), at.z()));
    tag("0020|0037", "1\\0\\0\\0\\1\\0");
    tag("0028|0030", fmt::format("{}\\{}", volume.spacing_mm[1], volume.spacing_mm[0]));
    auto writer = itk::ImageFileWriter<itk::Image<std::int16_t, 2>>::New();
    writer->SetImageIO(io);
    writer->UseInputMetaDataDictionaryOn();
    writer->SetFileName((folder / fmt::format("IM{:03}.dcm", 100 - k)).string());
    writer->SetInput(image);
    writer->Update();
  }
}

}  // namespace scan
