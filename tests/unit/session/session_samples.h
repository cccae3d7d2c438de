// A small valid session for the tests.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "acquisition/session/session_writer.h"

namespace scan {

inline Timestamp Time(std::int64_t count) {
  return {1'700'000'000'000'000'000 + count, 1000 + count};
}

// One camera of 16 x 12 pixels, two views at two aims.
inline SessionDocument SampleDocument() {
  SessionDocument document;
  document.id = "sample";
  document.created_utc_ns = 1'700'000'000'000'000'000;
  document.software.version = "0.1.0";
  document.specimen = {{"dwc:catalogNumber", "S-1"}};
  document.ct =
      CtDocument{Eigen::Vector3d(0.02, 0.02, 0.03), "bench", 60, 100, "none", 80, 400, ""};
  document.station.turntable = AxisDocument{"deg", 53.3333333333, 1, {}, {}, 0.1, OnStop::release};
  document.station.lift_axis = AxisDocument{"mm", 400, -1, 0.0, 250.0, 0.05, OnStop::hold};
  document.station.lift.kind = LiftKind::pitch_axis;
  CameraDocument camera;
  camera.id = "c0";
  camera.intrinsics = {16, 12, 47.4, 47.5, 8.1, 5.9, 0.01, -0.02, 0.001, 0.002, 0.003};
  camera.sigma = {0.01, 0};
  Eigen::Matrix3d rotation;  // looks along station -x, its down is station -z
  rotation << 0, 1, 0, 0, 0, -1, -1, 0, 0;
  camera.camera_from_lift["a0"] = CameraFromLift(rotation, Eigen::Vector3d(0, 5, 550));
  camera.camera_from_lift["a1"] = CameraFromLift(rotation, Eigen::Vector3d(0, 7, 550.125));
  camera.camera_from_lift_sigma = {0.5, 2};
  document.station.cameras.push_back(camera);
  PlannedView view{"v000", "c0", 0, 0, 8000, 1, "m0", "a0", ""};
  document.views.push_back(view);
  document.views.push_back({"v001", "c0", 15, 120.5, 8000, 1, "m0", "a1", ""});
  return document;
}

inline std::vector<std::byte> SamplePng(int w, int h, int grey) {
  const cv::Mat picture(h, w, CV_8UC3, cv::Scalar(grey, grey / 2, 255 - grey));
  std::vector<unsigned char> bytes;
  cv::imencode(".png", picture, bytes);
  const auto view = std::as_bytes(std::span(bytes));
  return {view.begin(), view.end()};
}

inline FrameEntry SampleFrame(const PlannedView& view) {
  FrameEntry frame;
  frame.view = view.id;
  frame.camera = view.camera;
  frame.sensor_sequence = 7;
  frame.exposure = ExposureBound{10, 20, ExposureSource::trigger};
  frame.applied = {8000.0, 1.5};
  frame.reference_epoch = 1;
  frame.axes.turntable_deg =
      AxisReading{view.turntable_deg, view.turntable_deg, view.turntable_deg + 0.01, 0.1, 0.02};
  frame.axes.lift_mm = AxisReading{view.lift_mm, view.lift_mm, view.lift_mm, 0.2, 0.05};
  return frame;
}

inline StagePosition SamplePosition() { return {{0, 0, 0, 0.1, 0}, {0, 0, 0, 0.2, 0}}; }

template <class T>
testing::AssertionResult IsOk(const Result<T>& result) {
  if (result) return testing::AssertionSuccess();
  return testing::AssertionFailure() << ToString(result.error());
}

// home, plate, two frames, end.
inline Status WriteSampleLog(SessionWriter& writer) {
  SCAN_CHECK(writer.Append(HomeEntry{1, SamplePosition()}, Time(1)));
  const std::vector<EncodedFile> plate = {{"png", SamplePng(16, 12, 10)}};
  SCAN_CHECK(
      writer.AppendPlate({PlateKind::background, "c0", "a0", {}, {8000.0, {}}}, plate, Time(2)));
  int count = 3;
  const auto views = writer.state().views();
  for (const auto& view : views) {
    const std::vector<EncodedFile> pictures = {{"png", SamplePng(16, 12, 100 + count)}};
    SCAN_CHECK(writer.AppendFrame(SampleFrame(view), pictures, Time(count++)));
  }
  SCAN_CHECK(writer.Append(EndEntry{EndResult::complete, ""}, Time(count)));
  return {};
}

inline Status WriteSampleSession(const std::filesystem::path& folder) {
  SCAN_TRY(SessionWriter writer, CreateSession(folder, SampleDocument(), Time(0)));
  return WriteSampleLog(writer);
}

inline void WriteText(const std::filesystem::path& path, std::string_view text) {
  std::ofstream(path, std::ios::binary) << text;
}

}  // namespace scan
