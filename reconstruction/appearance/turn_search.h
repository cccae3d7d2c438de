// The turn about the axis at which colour follows what lies under the surface best.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "reconstruction/appearance/ring_map.h"

namespace scan {

struct TurnSearchOptions {
  double smoothing_mm = 0.6;  // of both maps
  int bins = 12;              // of each quantity, equally filled
  int bands = 10;             // of rings, for sigma and significance
  // Decided when the best turn beats every other by that many standard errors and stands that many
  // standard deviations over the rest of the circle.
  double least_gap = 3.5;
  double least_score = 5.0;
  double largest_sigma_rad = 0.05;
};

struct TurnEstimate {
  bool decided = false;
  std::string reason;    // why not; empty when decided
  double turn_rad = 0;   // colours at this azimuth further along belong to the features; [-pi, pi)
  double sigma_rad = 0;  // from the scatter between bands of rings
  double score = 0;  // height of the peak over the rest of the circle, in its standard deviations
  double runner_up_rad = 0;  // the next best turn
  double gap = 0;            // by which it falls behind, in standard errors
  // Mutual information over the circle in nats, summed over features and channels; of the middle of
  // the circle's values taken off. Turn i is 2 pi i / size.
  std::vector<double> curve;
};

// Mutual information of every feature with every colour channel, each as its rank (so that any
// relation counts, whatever its form), rings' means taken off, by histograms with linear Parzen
// windows; summed. Bands of rings must agree: the peak's advantage is held against its scatter when
// bands are left out in turn, so that one spot of colour that happens to fit one spot of density
// decides nothing. Undecided where colour or features have no azimuth, are not related, or fit at
// two turns. Thread contract: const calls from any thread; parallel inside; the same bytes for any
// number of threads.
class TurnSearch {
 public:
  // `grid` outlives the search. Precondition: at least as many rings as bands.
  TurnSearch(const TurningGrid& grid, std::span<const RingMap> features,
             const TurnSearchOptions& options = {});
  ~TurnSearch();

  TurnEstimate Find(std::span<const RingMap> colours) const;

 private:
  struct Ranked;
  const TurningGrid& grid_;
  TurnSearchOptions options_;
  std::unique_ptr<const Ranked> features_;
};

}  // namespace scan
