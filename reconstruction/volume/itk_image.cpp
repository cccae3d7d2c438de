#include "reconstruction/volume/itk_image.h"

#include <fmt/format.h>
#include <gdcmTrace.h>
#include <itkGDCMImageIO.h>
#include <itkGDCMSeriesFileNames.h>
#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkImageSeriesReader.h>
#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <itkPNGImageIO.h>
#include <itkTIFFImageIO.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>

#include "reconstruction/volume/whole_file.h"

namespace scan {
namespace {

namespace fs = std::filesystem;
using Image3 = itk::Image<float, 3>;
using Image2 = itk::Image<float, 2>;

itk::ImageIOBase::Pointer MakeIo(VolumeFormat format) {
  switch (format) {
    case VolumeFormat::metaimage:
      return itk::MetaImageIO::New().GetPointer();
    case VolumeFormat::nrrd:
      return itk::NrrdImageIO::New().GetPointer();
    case VolumeFormat::nifti:
      return itk::NiftiImageIO::New().GetPointer();
    case VolumeFormat::tiff:
      return itk::TIFFImageIO::New().GetPointer();
    case VolumeFormat::png:
      return itk::PNGImageIO::New().GetPointer();
  }
  return {};
}

// Third parties' exceptions end here: one bad_input line each.
template <class Fn>
auto Guarded(const fs::path& path, Fn&& fn) -> decltype(fn()) {
  itk::Object::SetGlobalWarningDisplay(false);
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
  const auto unreadable = [&](std::string why) {
    std::replace(why.begin(), why.end(), '\n', ' ');
    return BadInput("cannot be read as a volume (" + why + ")", path.string(),
                    "check that the file is whole and of the format its name says");
  };
  try {
    return fn();
  } catch (const itk::ExceptionObject& e) {
    return unreadable(e.GetDescription());
  } catch (const std::bad_alloc&) {
    return unreadable("not enough memory");
  } catch (const std::exception& e) {
    return unreadable(e.what());
  }
}

Status CheckGrey(const itk::ImageIOBase& io, const fs::path& path) {
  if (io.GetNumberOfComponents() == 1) return {};
  return BadInput(fmt::format("{} values a voxel (colour or vectors)", io.GetNumberOfComponents()),
                  path.string(), "convert it to single grey values");
}

// Twice the floats must fit: the reader holds the file's own type beside them.
Status CheckMemory(double voxels, const fs::path& path) {
  const double memory = static_cast<double>(::sysconf(_SC_PHYS_PAGES)) *
                        static_cast<double>(::sysconf(_SC_PAGE_SIZE));
  if (voxels * 2 * sizeof(float) < memory) return {};
  return BadInput(fmt::format("{:.3g} voxels do not fit into the memory of this machine", voxels),
                  path.string(), "check the size in the header, or reduce the volume");
}

std::string HeaderText(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(16384, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text;
}

struct HeaderFacts {
  bool has_spacing = false;
  fs::path data;  // the one file of the data; empty: several files, or the reader checks itself
  bool deflated = false;
  std::uint64_t offset = 0;  // of the deflated data
};

// Value of a line KEY = VALUE of a MetaImage header, blanks about the sign or none; empty without.
std::string MetaImageValue(std::string_view text, std::string_view key) {
  constexpr std::string_view kBlanks = " \t\r";
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.size(), text.find('\n', at));
    const std::string_view line = text.substr(at, end - at);
    at = end + 1;
    const std::size_t sign = line.find('=');
    if (sign == std::string_view::npos || !line.starts_with(key)) continue;
    if (line.substr(key.size(), sign - key.size()).find_first_not_of(kBlanks) !=
        std::string_view::npos)
      continue;
    const std::size_t first = line.find_first_not_of(kBlanks, sign + 1);
    if (first == std::string_view::npos) return {};
    return std::string(line.substr(first, line.find_last_not_of(kBlanks) + 1 - first));
  }
  return {};
}

HeaderFacts MetaImageFacts(const fs::path& path, std::string text) {
  const std::size_t key = text.find("ElementDataFile");
  text.resize(std::min(text.size(), key == std::string::npos ? text.size() : text.find('\n', key)));
  HeaderFacts facts;
  facts.has_spacing = text.find("ElementSpacing") != std::string::npos ||
                      text.find("ElementSize") != std::string::npos;
  if (key == std::string::npos) return facts;
  const std::string compressed = MetaImageValue(text, "CompressedData");
  facts.deflated = compressed.starts_with('T') || compressed.starts_with('t') ||
                   compressed.starts_with('1');  // what MetaIO takes for true
  const std::string data = MetaImageValue(text, "ElementDataFile");
  if (data == "LOCAL") {
    facts.data = path;
    facts.offset = text.size() + 1;
  } else if (fs::is_regular_file(path.parent_path() / data)) {
    facts.data = path.parent_path() / data;  // a list or a pattern of files is left to the reader
  }
  return facts;
}

HeaderFacts ReadHeaderFacts(const fs::path& path, VolumeFormat format) {
  std::string text = HeaderText(path);
  const auto has = [&](std::string_view word) { return text.find(word) != std::string::npos; };
  switch (format) {
    case VolumeFormat::metaimage:
      return MetaImageFacts(path, std::move(text));
    case VolumeFormat::nrrd: {
      text.resize(std::min(text.size(), text.find("\n\n")));
      const bool raw = has("encoding: raw") && !has("data file:") && !has("datafile:");
      return {has("spacings:") || has("space directions:"), raw ? path : fs::path(), false, 0};
    }
    case VolumeFormat::nifti:
      return {true, path.extension() == ".nii" ? path : fs::path(), false, 0};
    default:
      return {};
  }
}

// Some readers fill with zeros what a truncated file lacks: so its size is checked beforehand.
Status CheckBytes(const itk::ImageIOBase& io, const fs::path& path, const HeaderFacts& facts) {
  if (facts.data.empty()) return {};
  const auto wanted = static_cast<std::uintmax_t>(io.GetImageSizeInBytes());
  if (facts.deflated) return CheckDeflateWhole(facts.data, facts.offset, wanted);
  std::error_code code;
  const std::uintmax_t bytes = fs::file_size(facts.data, code);
  if (code || wanted <= bytes) return {};
  return BadInput(fmt::format("the file is truncated: {} bytes of {} are there", bytes, wanted),
                  path.string(), "copy it again");
}

Volume CopyOut(const Image3& image) {
  Volume volume;
  const auto size = image.GetLargestPossibleRegion().GetSize();
  for (unsigned a = 0; a < 3; ++a) {
    volume.size[a] = size[a];
    volume.spacing_mm[a] = image.GetSpacing()[a];
    volume.origin_mm[a] = image.GetOrigin()[a];
    for (unsigned b = 0; b < 3; ++b) volume.direction(a, b) = image.GetDirection()[a][b];
  }
  const float* grey = image.GetBufferPointer();
  volume.grey.assign(grey, grey + volume.voxels());
  return volume;
}

Status CheckDimensions(const itk::ImageIOBase& io, const fs::path& path) {
  double voxels = 1;
  for (unsigned a = 0; a < io.GetNumberOfDimensions(); ++a) {
    voxels *= static_cast<double>(io.GetDimensions(a));
    if (a >= 3 && io.GetDimensions(a) > 1)
      return BadInput("more than three dimensions", path.string(), "extract one volume of it");
  }
  return CheckMemory(voxels, path);
}

}  // namespace

Result<FileVolume> ReadVolumeFile(const fs::path& path, VolumeFormat format) {
  return Guarded(path, [&]() -> Result<FileVolume> {
    const HeaderFacts facts = ReadHeaderFacts(path, format);
    if (format == VolumeFormat::tiff) SCAN_CHECK(CheckTiffWhole(path));
    if (path.extension() == ".gz") SCAN_CHECK(CheckGzipWhole(path));
    auto io = MakeIo(format);
    if (!io->CanReadFile(path.c_str()))
      return BadInput("is not of the format its name says", path.string(),
                      "check the file, or give it its right extension");
    io->SetFileName(path.string());
    io->ReadImageInformation();
    SCAN_CHECK(CheckGrey(*io, path));
    SCAN_CHECK(CheckDimensions(*io, path));
    SCAN_CHECK(CheckBytes(*io, path, facts));
    auto reader = itk::ImageFileReader<Image3>::New();
    reader->SetImageIO(io);
    reader->SetFileName(path.string());
    reader->Update();
    return FileVolume{CopyOut(*reader->GetOutput()), facts.has_spacing};
  });
}

Result<FileVolume> ReadSlices(const std::vector<fs::path>& slices, VolumeFormat format) {
  FileVolume out;
  Volume& volume = out.volume;
  for (std::size_t k = 0; k < slices.size(); ++k) {
    const fs::path& path = slices[k];
    const Status done = Guarded(path, [&]() -> Status {
      if (format == VolumeFormat::tiff) SCAN_CHECK(CheckTiffWhole(path));
      auto io = MakeIo(format);
      if (!io->CanReadFile(path.c_str()))
        return BadInput("is not of the format its name says", path.string(),
                        "check the file, or remove it from the folder");
      io->SetFileName(path.string());
      io->ReadImageInformation();
      SCAN_CHECK(CheckGrey(*io, path));
      const std::size_t w = io->GetDimensions(0), h = io->GetDimensions(1);
      if (k == 0) {
        volume.size = {w, h, slices.size()};
        SCAN_CHECK(CheckMemory(
            static_cast<double>(w) * static_cast<double>(h) * static_cast<double>(slices.size()),
            path));
        volume.grey.resize(volume.voxels());
      }
      if (w != volume.size[0] || h != volume.size[1] ||
          (io->GetNumberOfDimensions() > 2 && io->GetDimensions(2) > 1))
        return BadInput(fmt::format("slice of {} x {} instead of {} x {}", w, h, volume.size[0],
                                    volume.size[1]),
                        path.string(), "all slices of a folder must have one size");
      auto reader = itk::ImageFileReader<Image2>::New();
      reader->SetImageIO(io);
      reader->SetFileName(path.string());
      reader->Update();
      std::copy_n(reader->GetOutput()->GetBufferPointer(), w * h, &volume.grey[k * w * h]);
      return {};
    });
    SCAN_CHECK(done);
  }
  return out;
}

Result<FileVolume> ReadDicomSeries(const fs::path& folder) {
  return Guarded(folder, [&]() -> Result<FileVolume> {
    auto names = itk::GDCMSeriesFileNames::New();
    names->SetGlobalWarningDisplay(false);
    names->SetDirectory(folder.string());
    const auto series = names->GetSeriesUIDs();
    if (series.empty())
      return BadInput("the folder holds no PNG, TIFF or DICOM slices", folder.string(),
                      "name the volume file, or the folder with the slices");
    if (series.size() > 1)
      return BadInput(fmt::format("the folder holds {} DICOM series", series.size()),
                      folder.string(), "put the wanted series into a folder of its own");
    const auto files = names->GetFileNames(series.front());
    auto io = itk::GDCMImageIO::New();
    io->SetFileName(files.front());
    io->ReadImageInformation();
    SCAN_CHECK(CheckGrey(*io, files.front()));
    SCAN_CHECK(CheckMemory(static_cast<double>(io->GetDimensions(0)) *
                               static_cast<double>(io->GetDimensions(1)) *
                               static_cast<double>(files.size()),
                           folder));
    std::string value;
    const bool has_spacing =
        itk::ExposeMetaData<std::string>(io->GetMetaDataDictionary(), "0028|0030", value) ||
        itk::ExposeMetaData<std::string>(io->GetMetaDataDictionary(), "0018|1164", value);
    auto reader = itk::ImageSeriesReader<Image3>::New();
    reader->SetImageIO(io);
    reader->SetFileNames(files);
    reader->Update();
    double deviation = 0;
    itk::ExposeMetaData<double>(reader->GetOutput()->GetMetaDataDictionary(),
                                "ITK_non_uniform_sampling_deviation", deviation);
    if (deviation > 0.01 * reader->GetOutput()->GetSpacing()[2])
      return BadInput(
          fmt::format("slices are missing or unevenly spaced (by {:.3g} mm)", deviation),
          folder.string(), "export the whole series again");
    return FileVolume{CopyOut(*reader->GetOutput()), has_spacing};
  });
}

}  // namespace scan
