// How late the steps of one move were.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

namespace scan {

// Counts in buckets a quarter of an octave wide; a quantile is its bucket's upper end.
// Thread contract: plain value.
class LatenessHistogram {
 public:
  void Add(std::int64_t late_ns) {
    late_ns = std::max<std::int64_t>(late_ns, 0);
    ++counts_[BucketOf(static_cast<std::uint64_t>(late_ns))];
    ++count_;
    max_ns_ = std::max(max_ns_, late_ns);
  }
  std::int64_t count() const { return count_; }
  std::int64_t max_ns() const { return max_ns_; }
  // At least this share of the steps was not later. 0 without steps.
  std::int64_t QuantileNs(double share) const {
    auto wanted = static_cast<std::int64_t>(share * static_cast<double>(count_));
    for (std::size_t k = 0; k < counts_.size(); ++k) {
      wanted -= counts_[k];
      if (wanted <= 0 && count_ > 0) return std::min(UpperEndNs(k), max_ns_);
    }
    return max_ns_;
  }

 private:
  // Below 4 ns one bucket each, then four to an octave.
  static std::size_t BucketOf(std::uint64_t ns) {
    if (ns < 4) return ns;
    const auto octave = static_cast<std::size_t>(std::bit_width(ns)) - 1;
    return octave * 4 - 4 + ((ns >> (octave - 2)) & 3);
  }
  static std::int64_t UpperEndNs(std::size_t bucket) {
    if (bucket < 4) return static_cast<std::int64_t>(bucket);
    const std::size_t octave = bucket / 4 + 1;
    return (std::int64_t{5} + static_cast<std::int64_t>(bucket % 4)) *
               (std::int64_t{1} << (octave - 2)) -
           1;
  }

  std::array<std::int64_t, 252> counts_{};
  std::int64_t count_ = 0;
  std::int64_t max_ns_ = 0;
};

}  // namespace scan
