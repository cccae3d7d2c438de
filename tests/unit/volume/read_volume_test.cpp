#include "reconstruction/volume/read_volume.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <limits>

#include "drivers/base/files.h"
#include "drivers/base/rng.h"
#include "reconstruction/volume/write_volume.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/volume/write_formats.h"

namespace scan {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// Whole grey values 0..100, different in every voxel's neighbourhood, no two sizes the same.
Volume Sample() {
  Volume volume;
  volume.size = {7, 5, 12};
  volume.spacing_mm = {0.25, 0.5, 0.75};
  volume.origin_mm = {1, -2, 3};
  for (std::size_t v = 0; v < volume.voxels(); ++v)
    volume.grey.push_back(static_cast<float>(v * 37 % 101));
  return volume;
}

void ExpectSame(const Result<Volume>& read, const Volume& expected) {
  ASSERT_TRUE(read) << ToString(read.error());
  EXPECT_EQ(read->size, expected.size);
  EXPECT_LT((read->spacing_mm - expected.spacing_mm).norm(), 1e-6);
  EXPECT_LT((read->origin_mm - expected.origin_mm).norm(), 1e-5);
  EXPECT_LT((read->direction - expected.direction).norm(), 1e-5);
  EXPECT_EQ(read->grey, expected.grey);
}

void ExpectBadInput(const Result<Volume>& read, const std::string& word) {
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
  const std::string line = ToString(read.error());
  EXPECT_THAT(line, HasSubstr(word));
  EXPECT_EQ(line.find('\n'), std::string::npos);
}

ReadVolumeOptions WithVoxel(double x, double y, double z) {
  return {.voxel_mm = Eigen::Vector3d(x, y, z)};
}

void Truncate(const fs::path& path, double share) {
  fs::resize_file(path,
                  static_cast<std::uintmax_t>(share * static_cast<double>(fs::file_size(path))));
}

class EveryFile : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Formats, EveryFile,
                         testing::Values("v.mha", "v.mhd", "v.nrrd", "v.nii", "v.nii.gz"),
                         [](const auto& format) {
                           std::string name = format.param.substr(2);
                           std::erase(name, '.');
                           return name;
                         });

TEST_P(EveryFile, RoundTripWithItsPlaceInSpace) {
  const TempFolder folder;
  Volume volume = Sample();
  volume.direction = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  WriteWithItk(folder.path() / GetParam(), volume, Scalar::int16);
  ExpectSame(ReadVolume(folder.path() / GetParam()), volume);
}

TEST_P(EveryFile, AnyScalarType) {
  const TempFolder folder;
  for (const Scalar scalar : {Scalar::int8, Scalar::uint8, Scalar::uint16, Scalar::int32,
                              Scalar::uint32, Scalar::float32, Scalar::float64}) {
    WriteWithItk(folder.path() / GetParam(), Sample(), scalar);
    ExpectSame(ReadVolume(folder.path() / GetParam()), Sample());
  }
}

TEST_P(EveryFile, TruncatedIsBadInput) {
  const TempFolder folder;
  const fs::path path = folder.path() / GetParam();
  Volume volume = Sample();
  volume.size[2] = 120;
  volume.grey.resize(volume.voxels(), 9);
  WriteWithItk(path, volume, Scalar::float64);
  Truncate(GetParam() == "v.mhd" ? folder.path() / "v.raw" : path, 0.5);
  ExpectBadInput(ReadVolume(path), GetParam());
}

TEST_P(EveryFile, GarbageIsBadInput) {
  const TempFolder folder;
  const fs::path path = folder.path() / GetParam();
  ASSERT_TRUE(WriteFileDurably(path, std::string_view("not a volume at all, only some words\n")));
  ExpectBadInput(ReadVolume(path), GetParam());
}

// Other programs write KEY=VALUE, which MetaIO reads as well.
TEST(ReadVolume, MetaImageHeadersWithoutBlanks) {
  const TempFolder folder;
  const fs::path path = folder.path() / "v.mha";
  ASSERT_TRUE(WriteVolume(path, Sample(), {.type = GreyType::uint16}));
  std::string text = ReadTextFile(path).value();
  const std::string compressed = "CompressedData = True";
  ASSERT_NE(text.find(compressed), std::string::npos);
  text.replace(text.find(compressed), compressed.size(), "CompressedData=True");
  text.replace(text.find("ElementDataFile = "), 18, "ElementDataFile=");
  ASSERT_TRUE(WriteFileDurably(path, std::string_view(text)));
  ExpectSame(ReadVolume(path), Sample());
}

TEST(ReadVolume, GivenVoxelSizeOverridesTheFile) {
  const TempFolder folder;
  WriteWithItk(folder.path() / "v.mha", Sample(), Scalar::uint8);
  Volume expected = Sample();
  expected.spacing_mm = {0.1, 0.2, 0.3};
  ExpectSame(ReadVolume(folder.path() / "v.mha", WithVoxel(0.1, 0.2, 0.3)), expected);
}

TEST(ReadVolume, SlicesInNaturalOrderNeedAVoxelSize) {
  const TempFolder folder;
  Volume expected = Sample();
  expected.origin_mm.setZero();
  for (const std::string extension : {".png", ".tif"}) {
    const fs::path slices = folder.path() / extension.substr(1);
    WriteSlices(slices, expected, extension);
    ASSERT_TRUE(WriteFileDurably(slices / "notes.txt", std::string_view("beside the slices")));
    ExpectSame(ReadVolume(slices, WithVoxel(0.25, 0.5, 0.75)), expected);
    ExpectBadInput(ReadVolume(slices), "--voxel-mm");
  }
}

TEST(ReadVolume, MultiPageTiffNeedsAVoxelSize) {
  const TempFolder folder;
  Volume expected = Sample();
  expected.origin_mm.setZero();
  WriteWithItk(folder.path() / "v.tif", Sample(), Scalar::uint16);
  ExpectSame(ReadVolume(folder.path() / "v.tif", WithVoxel(0.25, 0.5, 0.75)), expected);
  ExpectBadInput(ReadVolume(folder.path() / "v.tif"), "--voxel-mm");
  Truncate(folder.path() / "v.tif", 0.5);
  ExpectBadInput(ReadVolume(folder.path() / "v.tif", WithVoxel(1, 1, 1)), "v.tif");
}

TEST(ReadVolume, DicomSeriesByPositionNotByName) {
  const TempFolder folder;
  WriteDicom(folder.path(), Sample());
  ExpectSame(ReadVolume(folder.path()), Sample());
}

TEST(ReadVolume, DicomSeriesWithAGapIsBadInput) {
  const TempFolder folder;
  WriteDicom(folder.path(), Sample());
  fs::remove(folder.path() / "IM095.dcm");
  ExpectBadInput(ReadVolume(folder.path()), "missing or unevenly spaced");
}

TEST(ReadVolume, NrrdAndMetaImageWithoutSpacingNeedOne) {
  const TempFolder folder;
  const fs::path nrrd = folder.path() / "v.nrrd", mha = folder.path() / "v.mha";
  ASSERT_TRUE(WriteFileDurably(nrrd,
                               "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\n"
                               "encoding: raw\n\nabcdefgh" +
                                   std::string()));
  ExpectBadInput(ReadVolume(nrrd), "--voxel-mm");
  EXPECT_TRUE(ReadVolume(nrrd, WithVoxel(1, 1, 1)));
  ASSERT_TRUE(WriteFileDurably(mha,
                               "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\n"
                               "ElementType = MET_UCHAR\nElementDataFile = LOCAL\nabcdefgh" +
                                   std::string()));
  ExpectBadInput(ReadVolume(mha), "--voxel-mm");
  EXPECT_TRUE(ReadVolume(mha, WithVoxel(1, 1, 1)));
}

TEST(ReadVolume, BadInputsAreOneLineEach) {
  const TempFolder folder;
  const fs::path f = folder.path();
  ExpectBadInput(ReadVolume(f / "missing.mha"), "no such file");
  ASSERT_TRUE(WriteFileDurably(f / "empty.nrrd", std::string_view()));
  ExpectBadInput(ReadVolume(f / "empty.nrrd"), "empty");
  ASSERT_TRUE(WriteFileDurably(f / "v.obj", std::string_view("v 0 0 0")));
  ExpectBadInput(ReadVolume(f / "v.obj"), "unknown volume format");
  fs::create_directory(f / "nothing");
  ExpectBadInput(ReadVolume(f / "nothing"), "no PNG, TIFF or DICOM");
  WriteColour(f / "colour.mha");
  ExpectBadInput(ReadVolume(f / "colour.mha"), "colour");
  ExpectBadInput(ReadVolume(f / "colour.mha", WithVoxel(0, 1, 1)), "colour");
  WriteWithItk(f / "v.mha", Sample(), Scalar::uint8);
  ExpectBadInput(ReadVolume(f / "v.mha", WithVoxel(0.1, -0.1, 0.1)), "voxel size");
  ExpectBadInput(ReadVolume(f / "v.mha", WithVoxel(0.1, std::nan(""), 0.1)), "voxel size");
  Volume flat = Sample();
  flat.size = {7, 60, 1};
  WriteWithItk(f / "flat.nrrd", flat, Scalar::uint8);
  ExpectBadInput(ReadVolume(f / "flat.nrrd"), "at least 2 voxels");
}

TEST(ReadVolume, NotANumberNamesItsVoxel) {
  const TempFolder folder;
  Volume volume = Sample();
  volume.grey[volume.index(3, 2, 1)] = std::numeric_limits<float>::quiet_NaN();
  WriteWithItk(folder.path() / "v.nrrd", volume, Scalar::float32);
  ExpectBadInput(ReadVolume(folder.path() / "v.nrrd"), "(3, 2, 1)");
}

TEST(ReadVolume, HeaderOfAnImpossibleSize) {
  const TempFolder folder;
  const fs::path path = folder.path() / "v.mha";
  ASSERT_TRUE(WriteFileDurably(path,
                               "ObjectType = Image\nNDims = 3\nDimSize = 90000 90000 90000\n"
                               "ElementSpacing = 1 1 1\nElementType = MET_UCHAR\n"
                               "ElementDataFile = LOCAL\nabcdefgh" +
                                   std::string()));
  ExpectBadInput(ReadVolume(path), "memory");
}

TEST(ReadVolume, SlicesThatDoNotMatch) {
  const TempFolder folder;
  const Volume volume = Sample();
  Volume wider = volume;
  wider.size = {14, 5, 6};
  WriteSlices(folder.path() / "a", volume, ".png");
  WriteSlices(folder.path() / "b", wider, ".png");
  fs::copy_file(folder.path() / "b/slice_3.png", folder.path() / "a/slice_3.png",
                fs::copy_options::overwrite_existing);
  ExpectBadInput(ReadVolume(folder.path() / "a", WithVoxel(1, 1, 1)), "slice_3.png");
  Truncate(folder.path() / "b/slice_4.png", 0.6);
  ExpectBadInput(ReadVolume(folder.path() / "b", WithVoxel(1, 1, 1)), "slice_4.png");
  WriteSlices(folder.path() / "b", wider, ".tif");
  ExpectBadInput(ReadVolume(folder.path() / "b", WithVoxel(1, 1, 1)), "both PNG and TIFF");
}

TEST(ReadVolume, TruncatedCompressedFilesAndTiffSlices) {
  const TempFolder folder;
  Volume noise = Sample();
  noise.size = {40, 40, 40};
  Rng rng(3);
  noise.grey.clear();
  for (std::size_t v = 0; v < noise.voxels(); ++v)
    noise.grey.push_back(static_cast<float>(rng.Below(60000)));
  for (const char* name : {"v.mha", "v.nrrd"}) {
    ASSERT_TRUE(WriteVolume(folder.path() / name, noise, {.type = GreyType::uint16}));
    Truncate(folder.path() / name, 0.7);
    ExpectBadInput(ReadVolume(folder.path() / name), name);
  }
  WriteSlices(folder.path() / "tif", Sample(), ".tif");
  Truncate(folder.path() / "tif/slice_7.tif", 0.3);
  ExpectBadInput(ReadVolume(folder.path() / "tif", WithVoxel(1, 1, 1)), "slice_7.tif");
}

// No byte of a header may crash the reader or make it hang.
TEST(ReadVolume, DamagedHeadersNeverCrash) {
  const TempFolder folder;
  Rng rng(11);
  for (const char* name : {"v.mha", "v.nrrd", "v.nii", "v.nii.gz", "v.tif"}) {
    const fs::path path = folder.path() / name;
    WriteWithItk(path, Sample(), Scalar::uint8);
    const std::string good = *ReadTextFile(path);
    for (int n = 0; n < 60; ++n) {
      std::string bad = good;
      for (int k = 0; k < 3; ++k)
        bad[rng.Below(std::min<std::size_t>(bad.size(), 400))] = static_cast<char>(rng.Below(256));
      ASSERT_TRUE(WriteFileDurably(path, bad));
      const auto read = ReadVolume(path, WithVoxel(1, 1, 1));
      EXPECT_TRUE(read ? read->grey.size() == read->voxels()
                       : read.error().kind == ErrorKind::bad_input);
    }
  }
}

TEST(WriteVolume, RoundTripOfEveryTypeAndFormat) {
  const TempFolder folder;
  for (const char* name : {"v.mha", "v.nrrd"})
    for (const GreyType type : {GreyType::uint8, GreyType::uint16, GreyType::float32})
      for (const bool compressed : {false, true}) {
        const fs::path path = folder.path() / name;
        ASSERT_TRUE(WriteVolume(path, Sample(), {.type = type, .compressed = compressed}));
        ExpectSame(ReadVolume(path), Sample());
      }
}

TEST(WriteVolume, IntegersRoundAndClamp) {
  const TempFolder folder;
  Volume volume = Sample();
  volume.grey[0] = -4.0f;
  volume.grey[1] = 1.6f;
  volume.grey[2] = 70000.0f;
  ASSERT_TRUE(WriteVolume(folder.path() / "v.mha", volume, {.type = GreyType::uint16}));
  const auto read = ReadVolume(folder.path() / "v.mha");
  ASSERT_TRUE(read);
  EXPECT_EQ(read->grey[0], 0.0f);
  EXPECT_EQ(read->grey[1], 2.0f);
  EXPECT_EQ(read->grey[2], 65535.0f);
}

TEST(WriteVolume, WholeOrNotAtAll) {
  const TempFolder folder;
  const auto failed = WriteVolume(folder.path() / "no/such/v.mha", Sample());
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().kind, ErrorKind::failed);
  const auto named = WriteVolume(folder.path() / "v.png", Sample());
  ASSERT_FALSE(named);
  EXPECT_EQ(named.error().kind, ErrorKind::bad_input);
  EXPECT_FALSE(WriteVolume(folder.path() / "v.mha", Volume{}));
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

}  // namespace
}  // namespace scan
