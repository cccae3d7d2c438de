// Bad input: one clear line, exit code 2, nothing written, nothing overwritten.
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "drivers/base/files.h"
#include "tests/support/temp_folder.h"
#include "tests/system/run_program.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

class BadInput : public ::testing::Test {
 protected:
  std::string Path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::string Write(const std::string& name, const std::string& text) {
    EXPECT_TRUE(WriteFileDurably(Path(name), std::string_view(text)));
    return Path(name);
  }
  // `what`: words that the line must have.
  void ExpectRefused(const std::vector<std::string>& arguments, const std::string& what) {
    const ProgramRun run = RunProgram("scanstation", arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    EXPECT_NE(run.err.find(what), std::string::npos) << run.err;
    EXPECT_FALSE(fs::exists(Path("out"))) << "nothing is written";
    for (const auto& entry : fs::directory_iterator(folder_.path()))
      EXPECT_EQ(entry.path().filename().string().find(".part"), std::string::npos)
          << "nothing is left behind";
  }
  TempFolder folder_;
};

TEST_F(BadInput, MissingFiles) {
  ExpectRefused({"surface", Path("none.nrrd"), "--out", Path("out")}, "none.nrrd");
  ExpectRefused({"atlas", Path("none.ply"), "--out", Path("out")}, "none.ply");
  ExpectRefused({"pose", Path("none"), "--mesh", Path("none.ply"), "--out", Path("out")}, "none");
  ExpectRefused({"import", "--photos", Path("none"), "--out", Path("out")}, "none");
  ExpectRefused({"reconstruct", Path("none"), "--mesh", Path("m.ply"), "--out", Path("out")},
                "none");
  ExpectRefused({"verify", Path("none")}, "none");
}

TEST_F(BadInput, TruncatedOrUnreadableFiles) {
  ExpectRefused({"surface", Write("a.nrrd", "NRRD0004\ntype: float\n"), "--out", Path("out")},
                "a.nrrd");
  ExpectRefused({"surface",
                 Write("b.mha",
                       "ObjectType = Image\nNDims = 3\nDimSize = 9 9 9\n"
                       "ElementSpacing = 1 1 1\nElementType = MET_UCHAR\n"
                       "ElementDataFile = LOCAL\nxx"),
                 "--out", Path("out")},
                "b.mha");
  ExpectRefused({"surface", Write("c.txt", "words"), "--out", Path("out")}, "c.txt");
  ExpectRefused(
      {"atlas", Write("d.ply", "ply\nformat ascii 1.0\nelement vertex 3\n"), "--out", Path("out")},
      "d.ply");
}

TEST_F(BadInput, MeshesWithoutFacesOrWithNan) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face ";
  const std::string tail = "\nproperty list uchar int vertex_indices\nend_header\n";
  ExpectRefused({"atlas", Write("empty.ply", head + "0" + tail + "0 0 0\n1 0 0\n0 1 0\n"), "--out",
                 Path("out")},
                "face");
  ExpectRefused({"atlas", Write("nan.ply", head + "1" + tail + "0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n"),
                 "--out", Path("out")},
                "nan.ply");
}

TEST_F(BadInput, AnEmptyVolume) {
  fs::create_directory(Path("slices"));
  for (const char* name : {"slices/0.png", "slices/1.png", "slices/2.png"})
    cv::imwrite(Path(name), cv::Mat(9, 9, CV_8U, cv::Scalar(7)));
  ExpectRefused({"surface", Path("slices"), "--out", Path("out")}, "--voxel-mm");
  ExpectRefused({"surface", Path("slices"), "--voxel-mm", "0.1", "--out", Path("out")}, "");
  cv::imwrite(Path("slices/3.png"), cv::Mat(8, 9, CV_8U, cv::Scalar(7)));
  ExpectRefused({"surface", Path("slices"), "--voxel-mm", "0.1", "--out", Path("out")}, "3.png");
}

TEST_F(BadInput, AMaskThatDoesNotMatchItsPhotograph) {
  fs::create_directory(Path("photos"));
  fs::create_directory(Path("masks"));
  cv::imwrite(Path("photos/a.png"), cv::Mat(24, 32, CV_8UC3, cv::Scalar(9, 9, 9)));
  cv::imwrite(Path("masks/a.png"), cv::Mat(24, 31, CV_8U, cv::Scalar(255)));
  ExpectRefused({"import", "--photos", Path("photos"), "--masks", Path("masks"), "--transforms",
                 Write("t.json",
                       "{\"fl_x\":100,\"fl_y\":100,\"cx\":16,\"cy\":12,\"w\":32,"
                       "\"h\":24,\"frames\":[{\"file_path\":\"photos/a.png\"}]}"),
                 "--out", Path("out")},
                "a.png");
}

TEST_F(BadInput, AStationFileWithAnUnknownKeyOrAValueOutOfRange) {
  for (const std::string text :
       {"name = \"x\"\nspeed_of_light = 3\n", "name = \"x\"\n[sim]\nspecimen = \"unicorn\"\n",
        "[sim]\njpeg_quality = 1000\n", "[[[\n"}) {
    const ProgramRun run = RunProgram(
        "scanstationd",
        {"--config", Write("station.toml", text), "--socket", Path("s.sock"), "--page-port", "-1"});
    EXPECT_EQ(run.exit_code, 2) << text << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  }
}

// Not bad input: the doctor has done its work, and the station is not ready.
TEST_F(BadInput, ADoctorThatFindsAStationNotReadySaysSoWithItsExitCode) {
  const ProgramRun missing =
      RunProgram("scanstation", {"doctor", "--config", Path("none.toml"), "--json"});
  EXPECT_EQ(missing.exit_code, 1) << missing.err;
  EXPECT_NE(missing.out.find("\"ready\": false"), std::string::npos) << missing.out;
  const std::string lamp =
      Write("lamp.toml", "[light]\ndriver = \"pwm\"\nchip = \"no-such-chip\"\n");
  EXPECT_EQ(RunProgram("scanstation", {"doctor", "--config", lamp}).exit_code, 1);
  EXPECT_EQ(RunProgram("scanstation", {"doctor", "--config", Write("sim.toml", "")}).exit_code, 0);
  EXPECT_EQ(RunProgram("scanstation", {"doctor", "--conf", lamp}).exit_code, 2);
}

TEST_F(BadInput, AnExistingOutputIsNotTouched) {
  const std::string mesh =
      Write("m.ply",
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
            "property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
            "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
  const std::string kept = Write("kept.obj", "mine");
  const ProgramRun run = RunProgram("scanstation", {"atlas", mesh, "--out", kept});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(ReadTextFile(kept).value(), "mine");
  EXPECT_EQ(RunProgram("scanstation", {"atlas", mesh, "--out", kept, "--force"}).exit_code, 0);
  EXPECT_NE(ReadTextFile(kept).value(), "mine");
}

TEST_F(BadInput, NumbersOutOfRange) {
  const std::string slices = Path("slices");
  fs::create_directory(slices);
  cv::imwrite(slices + "/0.png", cv::Mat(9, 9, CV_8U, cv::Scalar(7)));
  cv::imwrite(slices + "/1.png", cv::Mat(9, 9, CV_8U, cv::Scalar(7)));
  ExpectRefused({"surface", slices, "--voxel-mm", "0.1,0.2", "--out", Path("out")}, "--voxel-mm");
  const auto refused = [&](const std::vector<std::string>& arguments) {
    ExpectRefused(arguments, arguments[arguments.size() - 2]);
  };
  refused({"surface", slices, "--out", Path("out"), "--faces", "-5"});
  refused({"surface", slices, "--out", Path("out"), "--faces", "0"});
  refused({"surface", slices, "--out", Path("out"), "--voxel-mm", "-1"});
  refused({"surface", slices, "--out", Path("out"), "--voxel-mm", "nan"});
  refused({"atlas", Path("m.ply"), "--out", Path("out"), "--atlas-px", "0"});
  refused({"pose", Path("s"), "--mesh", "m.ply", "--out", Path("out"), "--chains", "0"});
  refused({"import", "--photos", slices, "--out", Path("out"), "--approx-distance-mm", "-1"});
  refused({"evaluate", "poses", "--paper-faces", "-5"});
}

TEST_F(BadInput, UnknownCommandsAndOptions) {
  EXPECT_EQ(RunProgram("scanstation", {"fly"}).exit_code, 2);
  EXPECT_EQ(RunProgram("scanstation", {"atlas", "--bend"}).exit_code, 2);
  EXPECT_EQ(RunProgram("scanstation", {}).exit_code, 2);
  EXPECT_EQ(RunProgram("scanstation", {"--help"}).exit_code, 0);
}

}  // namespace
}  // namespace scan
