#include "reconstruction/volume/segment.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "reconstruction/volume/threshold.h"

namespace scan {
namespace {

// Plausible component: of what is away from the side walls, and of all that is above the level.
constexpr double kLeastShareOfRest = 0.5;
constexpr double kLeastShareOfAll = 0.05;
// Of the best contrast at a plausible component's surface. Measured: ant in fluid 0.36, its bright
// gut content alone 0.57, a shading of the fluid 0.18.
constexpr double kLeastShareOfBestContrast = 0.45;
// Below it there is no outside at all: the densest pieces of a bone that fills the volume have
// 0.18.
constexpr double kLeastContrast = 0.25;
// Faces that the opening cut, of those of a cube of as many voxels: a specimen hangs on the wall by
// a bridge; the noise of air at its own median, which runs through the volume, by everything.
constexpr double kMostCutShare = 0.05;
constexpr std::size_t kVoxelsToJudge = 2'000'000;

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
  out.voxels_above = total;
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

void FillInnerSpaces(const ExteriorOptions& exterior, Segmentation& s) {
  s.filled = InnerSpaces(s.specimen, exterior);
  for (std::size_t v = 0; v < s.filled.inside.size(); ++v)
    s.specimen.inside[v] |= s.filled.inside[v];
  s.cavity_voxels = Count(s.filled);
  s.exterior = exterior;
}

// Means over cubes of `factor` voxels a side; what does not fill a cube at the far ends is left
// out.
Volume Reduced(const Volume& volume, std::size_t factor) {
  Volume out;
  for (int a = 0; a < 3; ++a) out.size[a] = std::max<std::size_t>(1, volume.size[a] / factor);
  out.grey.resize(out.voxels());
  tbb::parallel_for(std::size_t{0}, out.size[2], [&](std::size_t k) {
    for (std::size_t j = 0; j < out.size[1]; ++j)
      for (std::size_t i = 0; i < out.size[0]; ++i) {
        double sum = 0;
        int count = 0;
        for (std::size_t c = k * factor; c < std::min((k + 1) * factor, volume.size[2]); ++c)
          for (std::size_t b = j * factor; b < std::min((j + 1) * factor, volume.size[1]); ++b)
            for (std::size_t a = i * factor; a < std::min((i + 1) * factor, volume.size[0]); ++a)
              sum += volume.grey[volume.index(a, b, c)], ++count;
        out.grey[out.index(i, j, k)] = static_cast<float>(sum / count);
      }
  });
  return out;
}

// Mean grey one voxel inside and one voxel outside of the surface of `set`, along the axes; pairs
// whose inner voxel is not inside or whose outer one is, count for nothing.
void MeasureStep(const Volume& volume, const VoxelSet& set, LevelTried& level) {
  const std::ptrdiff_t strides[3] = {1, static_cast<std::ptrdiff_t>(set.size[0]),
                                     static_cast<std::ptrdiff_t>(set.size[0] * set.size[1])};
  double inner = 0, outer = 0, pairs = 0;
  level.cut_faces = 0;
  for (std::size_t k = 0; k < set.size[2]; ++k)
    for (std::size_t j = 0; j < set.size[1]; ++j)
      for (std::size_t i = 0; i < set.size[0]; ++i) {
        const std::size_t v = set.index(i, j, k), at[3] = {i, j, k};
        if (!set.inside[v]) continue;
        for (int a = 0; a < 3; ++a) {
          if (at[a] < 2 || at[a] + 2 >= set.size[a]) continue;
          for (const std::ptrdiff_t s : {strides[a], -strides[a]}) {
            const std::uint8_t* p = &set.inside[v];
            level.cut_faces += !p[s] && (&volume.grey[v])[s] >= level.threshold;
            if (p[s] || p[2 * s] || !p[-s]) continue;
            inner += (&volume.grey[v])[-s];
            outer += (&volume.grey[v])[2 * s];
            pairs += 1;
          }
        }
      }
  if (pairs > 0) level.inner = inner / pairs, level.outer = outer / pairs;
}

LevelTried Judge(const Volume& volume, double threshold, double darkest,
                 const SegmentOptions& options) {
  const Segmentation s =
      TakeLargest(volume, threshold, options.drop_side_walls, options.opening_radius);
  LevelTried level{.threshold = threshold,
                   .above = s.voxels_above,
                   .wall = s.side_wall_voxels,
                   .largest = s.voxels};
  MeasureStep(volume, s.specimen, level);
  if (level.inner > darkest) level.contrast = (level.inner - level.outer) / (level.inner - darkest);
  const auto share = [&](std::size_t of) {
    return static_cast<double>(s.voxels) / static_cast<double>(std::max<std::size_t>(of, 1));
  };
  level.plausible = share(s.voxels + s.small_voxels) >= kLeastShareOfRest &&
                    share(s.voxels_above) >= kLeastShareOfAll && level.contrast >= kLeastContrast &&
                    static_cast<double>(level.cut_faces) <=
                        kMostCutShare * 6 * std::pow(static_cast<double>(s.voxels), 2.0 / 3);
  return level;
}

struct Candidates {
  Volume reduced;
  double darkest = 0;
  std::vector<LevelTried> tried;
};

Status JudgeLevels(const std::vector<double>& levels, const SegmentOptions& options,
                   const ProgressFn& progress, const std::stop_token& stop, Candidates& c) {
  for (const double level : levels) {
    if (stop.stop_requested()) return Cancelled("segmentation");
    Report(progress, "segment",
           0.6 * static_cast<double>(c.tried.size()) / static_cast<double>(levels.size()));
    c.tried.push_back(Judge(c.reduced, level, c.darkest, options));
  }
  return {};
}

const LevelTried* BestLevel(const std::vector<LevelTried>& tried) {
  double best = 0;
  for (const LevelTried& l : tried)
    if (l.plausible) best = std::max(best, l.contrast);
  for (const LevelTried& l : tried)
    if (l.plausible && l.contrast >= kLeastShareOfBestContrast * best) return &l;
  return nullptr;
}

// The middle of the step at the component's surface, found again at the threshold it gives.
double MiddleOfStep(const Candidates& c, LevelTried level, const SegmentOptions& options) {
  for (int n = 0; n < 2; ++n) {
    const LevelTried next = Judge(c.reduced, 0.5 * (level.inner + level.outer), c.darkest, options);
    if (!next.plausible) break;
    level = next;
  }
  return 0.5 * (level.inner + level.outer);
}

Result<Segmentation> TakeBestLevel(const Volume& volume, const SegmentOptions& options,
                                   const ProgressFn& progress, const std::stop_token& stop) {
  const std::vector<double> levels = OtsuLevels(volume, 3, 2);
  if (levels.empty())
    return BadInput("all voxels have the same grey value", "volume",
                    "check that the file holds the scan of a specimen");
  std::size_t factor = 1;
  while (volume.voxels() / (factor * factor * factor) > kVoxelsToJudge) ++factor;
  Candidates c{
      factor > 1 ? Reduced(volume, factor) : volume, MeansAbout(volume, levels.front()).below, {}};
  SCAN_CHECK(JudgeLevels(levels, options, progress, stop, c));
  Segmentation s;
  if (const LevelTried* best = BestLevel(c.tried)) {
    s = TakeLargest(volume, MiddleOfStep(c, *best, options), options.drop_side_walls,
                    options.opening_radius);
  } else {
    s = TakeLargest(volume, OtsuLevels(volume, 1, 0).front(), false, 0);
    s.notes.push_back(
        "no threshold separates a specimen from the side walls: the largest component is kept "
        "whole");
  }
  s.levels = std::move(c.tried);
  return s;
}

}  // namespace

Result<Segmentation> Segment(const Volume& volume, const SegmentOptions& options,
                             const ProgressFn& progress, std::stop_token stop) {
  if (volume.voxels() == 0 || volume.grey.size() != volume.voxels())
    return BadInput("the volume is empty", "volume", "check the file and its size");
  Segmentation s;
  if (options.threshold) {
    s = TakeLargest(volume, *options.threshold, options.drop_side_walls, options.opening_radius);
  } else {
    SCAN_TRY(s, TakeBestLevel(volume, options, progress, stop));
  }
  if (s.voxels == 0)
    return BadInput(fmt::format("no voxel reaches the threshold {:g}", s.threshold), "volume",
                    "give a lower --threshold");
  if (stop.stop_requested()) return Cancelled("segmentation");
  if (options.grow_threshold) Grow(volume, *options.grow_threshold, s);
  s.filled = VoxelSet{volume.size, std::vector<std::uint8_t>(volume.voxels())};
  if (options.fill_cavities) FillInnerSpaces(options.exterior, s);
  s.voxels = Count(s.specimen);
  Report(progress, "segment", 1.0);
  return s;
}

}  // namespace scan
