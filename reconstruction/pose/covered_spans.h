// Which pixels a mesh covers, from those edges alone across which the number of covering faces
// changes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace scan {

// A fine mesh has hundreds of faces for each such edge, and a picture millions of pixels for each
// thousand that lie along an outline: rows keep where coverage begins and ends. Built once, then
// asked. Thread contract: const calls from any thread.
class CoveredSpans {
 public:
  // Of a picture, px.
  CoveredSpans(int w, int h) : w_(w), h_(h) {}

  // The edge from `a` to `b` (px, finite; rows run down) has `net` more faces on the side where
  // (b - a) x (c - a) > 0 for their third corner c than on the other. The edges of every face in
  // the picture must be added, or add up to nothing.
  void AddEdge(const Eigen::Vector2d& a, const Eigen::Vector2d& b, int net);

  // After the last edge.
  void Finish();

  // Whether a face covers the centre of the pixel at `p`; false outside of the picture.
  bool Covered(const Eigen::Vector2d& p) const;

 private:
  struct Crossing {
    std::int32_t row, column;  // the first pixel whose centre lies right of the edge
    std::int32_t more;         // faces than left of it
  };
  struct Span {
    std::int32_t begin, end;
  };
  int w_, h_;
  std::vector<Crossing> crossings_;
  std::vector<Span> spans_;
  std::vector<std::uint32_t> first_span_;  // of each row and one more
};

}  // namespace scan
