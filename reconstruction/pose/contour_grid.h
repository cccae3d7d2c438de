// Contour segments in a uniform grid, for crossings along a line.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace scan {

// Straight piece of a contour in pixels; `normal` of unit length, towards the background.
struct GridSegment {
  Eigen::Vector2d a, b;
  Eigen::Vector2d normal;
  std::uint8_t flags = 0;  // of ContourFlag
};

struct ContourCrossing {
  double distance_px = 0;  // signed, along the direction asked for
  int segment = -1;
};

// Thread contract: const calls from any thread.
class ContourGrid {
 public:
  ContourGrid() = default;
  ContourGrid(std::vector<GridSegment> segments, int width, int height);

  const std::vector<GridSegment>& segments() const { return segments_; }

  // The crossing nearest to `from` within +-window_px along the unit vector `along`, among the
  // segments whose normal makes at most acos(min_cosine) with it.
  std::optional<ContourCrossing> Nearest(const Eigen::Vector2d& from, const Eigen::Vector2d& along,
                                         double window_px, double min_cosine) const;

 private:
  int CellAt(int x, int y) const { return y * columns_ + x; }
  void Walk(const Eigen::Vector2d& from, const Eigen::Vector2d& direction,
            const Eigen::Vector2d& along, double sign, double window_px, double min_cosine,
            std::optional<ContourCrossing>& best) const;

  std::vector<GridSegment> segments_;
  int columns_ = 0, rows_ = 0;
  std::vector<std::int32_t> begin_;  // per cell, into members_; one more than cells
  std::vector<std::int32_t> members_;
};

}  // namespace scan
