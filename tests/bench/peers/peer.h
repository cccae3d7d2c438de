// What every method of the table gets, and what it gives back.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "reconstruction/evaluate/pose_trial.h"

namespace scan::bench {

struct PeerScene {
  std::string name;
  PoseTrial trial;                // the true poses in a frame of their own for real ones
  std::vector<cv::Mat> pictures;  // CV_8UC3, BGR
  std::vector<CameraFromModel>
      start;               // by the log, with a placing that is roughly known; empty: unknown
  bool same_frame = true;  // truth and mesh share one
};

struct PeerPoses {
  std::string method;
  std::vector<std::optional<CameraFromModel>> poses;  // one per photo; nothing: not solved
  bool own_scale = false;                             // and frame, known up to a similarity
  double seconds = 0, processor_seconds = 0;
  std::string remark;
};

}  // namespace scan::bench
