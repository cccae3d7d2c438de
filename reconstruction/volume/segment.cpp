#include "reconstruction/volume/segment.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "reconstruction/volume/threshold.h"

namespace scan {
namespace {

// A level is taken when the largest component away from the side walls holds this share of it.
constexpr double kPlausibleShare = 0.2;

VoxelSet Above(const Volume& volume, double threshold) {
  VoxelSet set{volume.size, std::vector<std::uint8_t>(volume.voxels())};
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, set.inside.size()), [&](const auto& range) {
    for (std::size_t v = range.begin(); v < range.end(); ++v)
      set.inside[v] = volume.grey[v] >= threshold;
  });
  return set;
}

// Voxels of `set` nearer, along face-connected paths inside `set`, to `claimed` than to `rest`;
// both are subsets of `set`. Ties go to the rest.
VoxelSet NearerTo(const VoxelSet& set, const VoxelSet& claimed, const VoxelSet& rest) {
  enum : std::uint8_t { kOpen = 0, kRest = 1, kClaimed = 2 };
  VoxelSet out{set.size, std::vector<std::uint8_t>(set.inside.size(), kOpen)};
  std::vector<std::size_t> front, next;
  for (std::size_t v = 0; v < rest.inside.size(); ++v)
    if (rest.inside[v] && !claimed.inside[v]) {
      out.inside[v] = kRest;
      front.push_back(v);
    }
  for (std::size_t v = 0; v < claimed.inside.size(); ++v)
    if (claimed.inside[v]) {
      out.inside[v] = kClaimed;
      front.push_back(v);
    }
  const std::size_t w = set.size[0], wh = set.size[0] * set.size[1];
  while (!front.empty()) {
    next.clear();
    for (const std::size_t v : front) {
      const std::size_t i = v % w, j = v / w % set.size[1], k = v / wh;
      const auto take = [&](bool exists, std::size_t to) {
        if (!exists || !set.inside[to] || out.inside[to] != kOpen) return;
        out.inside[to] = out.inside[v];
        next.push_back(to);
      };
      take(i > 0, v - 1);
      take(i + 1 < w, v + 1);
      take(j > 0, v - w);
      take(j + 1 < set.size[1], v + w);
      take(k > 0, v - wh);
      take(k + 1 < set.size[2], v + wh);
    }
    front.swap(next);
  }
  for (auto& v : out.inside) v = v == kClaimed;
  return out;
}

VoxelSet Select(const VoxelSet& set, const Labelling& labelling,
                const std::vector<std::uint8_t>& wanted) {
  VoxelSet out{set.size, std::vector<std::uint8_t>(set.inside.size())};
  for (std::size_t v = 0; v < out.inside.size(); ++v)
    out.inside[v] = set.inside[v] && wanted[labelling.label[v] - 1];
  return out;
}

std::vector<std::uint8_t> SideWallFlags(const Labelling& labelling) {
  std::vector<std::uint8_t> flags;
  for (const Component& c : labelling.components) flags.push_back(c.side_wall);
  return flags;
}

// What touches a side wall, without what only hangs on it by a bridge that the opening cuts.
VoxelSet SideWallPart(const VoxelSet& above, const Labelling& labelling, int opening_radius) {
  const VoxelSet touching = Select(above, labelling, SideWallFlags(labelling));
  if (opening_radius <= 0) return touching;
  VoxelSet opened = Dilated(Eroded(touching, opening_radius), opening_radius);
  for (std::size_t v = 0; v < opened.inside.size(); ++v) opened.inside[v] &= touching.inside[v];
  const Labelling parts = LabelComponents(opened, Connectivity::faces);
  VoxelSet claimed = Select(opened, parts, SideWallFlags(parts));
  VoxelSet rest = opened;
  for (std::size_t v = 0; v < rest.inside.size(); ++v) rest.inside[v] &= !claimed.inside[v];
  // What touches the wall itself belongs to it however thin it is.
  const std::size_t w = above.size[0], h = above.size[1];
  for (std::size_t v = 0; v < rest.inside.size(); ++v) {
    const std::size_t i = v % w, j = v / w % h;
    if (touching.inside[v] && !rest.inside[v] && (i == 0 || i + 1 == w || j == 0 || j + 1 == h))
      claimed.inside[v] = 1;
  }
  return NearerTo(touching, claimed, rest);
}

std::ptrdiff_t LargestOf(const Labelling& labelling) {
  const auto& all = labelling.components;
  if (all.empty()) return -1;
  return std::max_element(all.begin(), all.end(),
                          [](const Component& a, const Component& b) { return a.voxels < b.voxels; }) -
         all.begin();
}

// The largest component above the threshold away from the side walls (or at all).
Segmentation TakeLargest(const Volume& volume, double threshold, bool drop_side_walls,
                         int opening_radius) {
  Segmentation out;
  out.threshold = threshold;
  VoxelSet above = Above(volume, threshold);
  Labelling labelling = LabelComponents(above, Connectivity::corners);
  out.components = labelling.components.size();
  const std::size_t total = Count(above);
  if (drop_side_walls) {
    const VoxelSet wall = SideWallPart(above, labelling, opening_radius);
    for (const Component& c : labelling.components) out.side_wall_components += c.side_wall;
    out.side_wall_voxels = Count(wall);
    for (std::size_t v = 0; v < above.inside.size(); ++v) above.inside[v] &= !wall.inside[v];
    labelling = LabelComponents(above, Connectivity::corners);
  }
  const std::ptrdiff_t largest = LargestOf(labelling);
  std::vector<std::uint8_t> wanted(labelling.components.size(), 0);
  if (largest >= 0) {
    wanted[largest] = 1;
    out.voxels = labelling.components[largest].voxels;
    out.small_components = labelling.components.size() - 1;
    out.small_voxels = total - out.side_wall_voxels - out.voxels;
  }
  out.specimen = Select(above, labelling, wanted);
  out.levels.push_back({threshold, total, out.voxels});
  return out;
}

// Region growing: everything from the lower threshold on that the specimen's voxels reach.
void Grow(const Volume& volume, double grow_threshold, Segmentation& s) {
  const VoxelSet above = Above(volume, grow_threshold);
  const Labelling labelling = LabelComponents(above, Connectivity::corners);
  std::vector<std::uint8_t> wanted(labelling.components.size(), 0);
  for (std::size_t v = 0; v < above.inside.size(); ++v)
    if (s.specimen.inside[v]) wanted[labelling.label[v] - 1] = 1;
  s.specimen = Select(above, labelling, wanted);
}

// Cavities of the closed set, and of the voxels that the closing added those that seal them.
void FillCavities(int closing_radius, Segmentation& s) {
  const VoxelSet closed = closing_radius > 0
                              ? Eroded(Dilated(s.specimen, closing_radius), closing_radius)
                              : s.specimen;
  const VoxelSet cavities = EnclosedCavities(closed);
  const VoxelSet near = Dilated(cavities, closing_radius + 1);
  s.filled = cavities;
  for (std::size_t v = 0; v < closed.inside.size(); ++v) {
    s.filled.inside[v] |= closed.inside[v] && near.inside[v] && !s.specimen.inside[v];
    s.specimen.inside[v] |= s.filled.inside[v];
  }
  s.cavity_voxels = Count(s.filled);
}

Result<Segmentation> ChooseLevel(const Volume& volume, const SegmentOptions& options,
                                 const ProgressFn& progress, const std::stop_token& stop) {
  const std::vector<double> levels =
      options.threshold ? std::vector{*options.threshold} : OtsuLevels(volume, options.otsu_levels);
  if (levels.empty())
    return BadInput("all voxels have the same grey value", "volume",
                    "check that the file holds the scan of a specimen");
  std::vector<LevelTried> tried;
  for (std::size_t n = 0; n < levels.size(); ++n) {
    if (stop.stop_requested()) return Cancelled("segmentation");
    Report(progress, "segment", 0.8 * static_cast<double>(n) / static_cast<double>(levels.size()));
    Segmentation s =
        TakeLargest(volume, levels[n], options.drop_side_walls, options.opening_radius);
    tried.push_back(s.levels.front());
    const double share = static_cast<double>(s.voxels) /
                         static_cast<double>(std::max<std::size_t>(tried.back().above, 1));
    if (share < kPlausibleShare) continue;
    s.levels = std::move(tried);
    return s;
  }
  Segmentation s = TakeLargest(volume, levels.front(), false, 0);
  s.levels = std::move(tried);
  if (options.drop_side_walls)
    s.notes.push_back(
        "no threshold separates a component from the side walls: the largest one is kept whole");
  return s;
}

}  // namespace

Result<Segmentation> Segment(const Volume& volume, const SegmentOptions& options,
                             const ProgressFn& progress, std::stop_token stop) {
  if (volume.voxels() == 0 || volume.grey.size() != volume.voxels())
    return BadInput("the volume is empty", "volume", "check the file and its size");
  SCAN_TRY(Segmentation s, ChooseLevel(volume, options, progress, stop));
  if (s.voxels == 0)
    return BadInput(fmt::format("no voxel reaches the threshold {:g}", s.threshold), "volume",
                    "give a lower --threshold");
  if (stop.stop_requested()) return Cancelled("segmentation");
  if (options.grow_threshold) Grow(volume, *options.grow_threshold, s);
  s.filled = VoxelSet{volume.size, std::vector<std::uint8_t>(volume.voxels())};
  if (options.fill_cavities) FillCavities(options.closing_radius, s);
  s.voxels = Count(s.specimen);
  Report(progress, "segment", 1.0);
  return s;
}

}  // namespace scan
