#include "reconstruction/volume/exterior.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <utility>

namespace scan {
namespace {

constexpr int kMostRadius = 11;  // squares of it and of twice it fit into a byte
// A space counts as a chamber when its clearance is greater by this than that of the way to it,
// voxels: a pore of one voxel leads to one of three.
constexpr double kWidening = 0.9;

// Copy of the box [low, low + size) of a set; what lies beyond the set is 0.
struct Crop {
  std::array<std::ptrdiff_t, 3> low{};
  VoxelSet set;
};

// The box about the inside voxels with `margin` free voxels on every side.
Crop CropAround(const VoxelSet& set, std::size_t margin) {
  std::array<std::size_t, 3> low = set.size, high{0, 0, 0};
  for (std::size_t k = 0; k < set.size[2]; ++k)
    for (std::size_t j = 0; j < set.size[1]; ++j) {
      const std::uint8_t* row = &set.inside[set.index(0, j, k)];
      const std::uint8_t* end = row + set.size[0];
      const std::uint8_t* first = std::find(row, end, 1);
      if (first == end) continue;
      std::size_t last = set.size[0] - 1;
      while (!row[last]) --last;
      const std::size_t from[3] = {static_cast<std::size_t>(first - row), j, k},
                        to[3] = {last, j, k};
      for (int a = 0; a < 3; ++a) {
        low[a] = std::min(low[a], from[a]);
        high[a] = std::max(high[a], to[a] + 1);
      }
    }
  Crop crop;
  for (int a = 0; a < 3; ++a) {
    if (high[a] <= low[a]) return {};
    crop.low[a] = static_cast<std::ptrdiff_t>(low[a]) - static_cast<std::ptrdiff_t>(margin);
    crop.set.size[a] = high[a] - low[a] + 2 * margin;
  }
  crop.set.inside.assign(crop.set.size[0] * crop.set.size[1] * crop.set.size[2], 0);
  for (std::size_t k = low[2]; k < high[2]; ++k)
    for (std::size_t j = low[1]; j < high[1]; ++j)
      std::copy_n(
          &set.inside[set.index(low[0], j, k)], high[0] - low[0],
          &crop.set.inside[crop.set.index(margin, j - low[1] + margin, k - low[2] + margin)]);
  return crop;
}

// Squared distance in voxels to the nearest inside voxel, exact up to r^2, r^2 + 1 beyond.
std::vector<std::uint8_t> SquaredDistanceUpTo(const VoxelSet& set, int radius) {
  const std::size_t w = set.size[0], h = set.size[1], d = set.size[2];
  const int far = radius * radius + 1;
  std::vector<std::uint8_t> along_x(set.inside.size()), in_slice(set.inside.size()),
      out(set.inside.size());
  tbb::parallel_for(std::size_t{0}, h * d, [&](std::size_t row) {
    const std::uint8_t* in = &set.inside[row * w];
    std::uint8_t* to = &along_x[row * w];
    int since = radius + 1;
    for (std::size_t i = 0; i < w; ++i) {
      since = in[i] ? 0 : std::min(since + 1, radius + 1);
      to[i] = static_cast<std::uint8_t>(since);
    }
    since = radius + 1;
    for (std::size_t i = w; i-- > 0;) {
      since = in[i] ? 0 : std::min(since + 1, radius + 1);
      const int least = std::min<int>(to[i], since);
      to[i] = static_cast<std::uint8_t>(std::min(least * least, far));
    }
  });
  const auto pass = [&](const std::vector<std::uint8_t>& from, int axis,
                        std::vector<std::uint8_t>& to) {
    tbb::parallel_for(std::size_t{0}, d, [&](std::size_t k) {
      for (std::size_t j = 0; j < h; ++j) {
        std::uint8_t* row = &to[set.index(0, j, k)];
        std::copy_n(&from[set.index(0, j, k)], w, row);
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(axis == 1 ? j : k);
        const std::ptrdiff_t count = static_cast<std::ptrdiff_t>(axis == 1 ? h : d);
        for (std::ptrdiff_t s = -radius; s <= radius; ++s) {
          if (s == 0 || at + s < 0 || at + s >= count) continue;
          const auto n = static_cast<std::size_t>(at + s);
          const std::uint8_t* other = &from[axis == 1 ? set.index(0, n, k) : set.index(0, j, n)];
          const auto add = static_cast<std::uint8_t>(s * s);
          for (std::size_t i = 0; i < w; ++i)
            row[i] = std::min(row[i], static_cast<std::uint8_t>(other[i] + add));
        }
      }
    });
  };
  pass(along_x, 1, in_slice);
  pass(in_slice, 2, out);
  return out;
}

// Voxels of `free` that paths of face neighbours in it join to the first voxel, which is in it.
VoxelSet JoinedToFirst(const VoxelSet& free) {
  const Labelling labelling = LabelComponents(free, Connectivity::faces);
  VoxelSet out{free.size, std::vector<std::uint8_t>(free.inside.size())};
  for (std::size_t v = 0; v < out.inside.size(); ++v)
    out.inside[v] = labelling.label[v] == labelling.label[0];
  return out;
}

// The outside as the ball reaches it: opening of the free space, of its part that reaches beyond.
VoxelSet ReachedByBall(const VoxelSet& solid, int radius) {
  const int squared = radius * radius;
  VoxelSet centres{solid.size, SquaredDistanceUpTo(solid, radius)};
  for (auto& v : centres.inside) v = v > squared;
  VoxelSet out = JoinedToFirst(centres);
  if (radius == 0) return out;
  out.inside = SquaredDistanceUpTo(out, radius);
  for (auto& v : out.inside) v = v <= squared;
  return out;
}

std::array<std::size_t, 6> FaceOffsets(const VoxelSet& set) {
  const std::size_t w = set.size[0], wh = w * set.size[1];
  return {std::size_t{0} - 1, 1, std::size_t{0} - w, w, std::size_t{0} - wh, wh};  // modulo 2^64
}

enum Space : std::uint8_t { kUnmet, kOutside, kChamber, kGap };

// Spreads spaces over the free voxels not met yet, the widest first; among equals first come first.
class Descent {
 public:
  Descent(const VoxelSet& solid, const std::vector<std::uint8_t>& clearance, int highest)
      : solid_(solid),
        clearance_(clearance),
        faces_(FaceOffsets(solid)),
        levels_(static_cast<std::size_t>(highest) + 1),
        at_(static_cast<std::size_t>(highest)) {}

  // visit(voxel, level) -> the space it becomes; `level` is the clearance of the narrowest place on
  // the widest way to it.
  template <class Visit>
  void Run(std::vector<Space>& space, Visit visit) {
    for (std::size_t v = 0; v < space.size(); ++v) {
      if (space[v] != kUnmet || solid_.inside[v]) continue;
      for (const std::size_t o : faces_)
        if (space[v + o] != kUnmet) {
          Push(v, space[v + o]);
          break;
        }
    }
    for (;; --at_) {
      for (std::size_t n = 0; n < levels_[at_].size(); ++n) {
        const auto [v, from] = levels_[at_][n];
        if (space[v] != kUnmet) continue;
        space[v] = visit(v, static_cast<int>(at_), from);
        for (const std::size_t o : faces_)
          if (space[v + o] == kUnmet && !solid_.inside[v + o]) Push(v + o, space[v]);
      }
      if (at_ == 0) return;
    }
  }

 private:
  struct Entry {
    std::size_t voxel;
    Space from;
  };
  void Push(std::size_t v, Space from) {
    levels_[std::min<std::size_t>(clearance_[v], at_)].push_back({v, from});
  }

  const VoxelSet& solid_;
  const std::vector<std::uint8_t>& clearance_;
  std::array<std::size_t, 6> faces_;
  std::vector<std::vector<Entry>> levels_;
  std::size_t at_;
};

// Beyond the outside's reach: chambers, wider by kWidening than the widest way to them. The line
// between a chamber and the outside is that of a watershed of the clearance: its narrowest place.
VoxelSet Chambers(const VoxelSet& solid, const VoxelSet& outside, int radius) {
  const int reach = std::min(radius + 2, kMostRadius), highest = reach * reach + 1;
  const std::vector<std::uint8_t> clearance = SquaredDistanceUpTo(solid, reach);
  std::vector<Space> start(solid.inside.size(), kUnmet);
  for (std::size_t v = 0; v < start.size(); ++v)
    if (outside.inside[v]) start[v] = kOutside;
  std::vector<Space> space = start;
  std::vector<std::size_t> chambers;
  Descent(solid, clearance, highest).Run(space, [&](std::size_t v, int level, Space) {
    if (std::sqrt(clearance[v]) >= std::sqrt(level) + kWidening) chambers.push_back(v);
    return kGap;
  });
  space = std::move(start);
  for (const std::size_t v : chambers) space[v] = kChamber;
  Descent(solid, clearance, highest).Run(space, [](std::size_t, int, Space from) { return from; });
  VoxelSet out{solid.size, std::vector<std::uint8_t>(solid.inside.size())};
  for (std::size_t v = 0; v < space.size(); ++v) out.inside[v] = space[v] == kChamber;
  return out;
}

// The 26 neighbours, the six that share a face first, then the twelve that share an edge; for each
// the mask of those among them that share a face with it.
struct Neighbourhood {
  std::array<std::ptrdiff_t, 26> offset{};
  std::array<std::uint32_t, 26> touching{};

  explicit Neighbourhood(const std::array<std::size_t, 3>& size) {
    std::vector<std::array<int, 3>> at;
    for (int distance = 1; distance <= 3; ++distance)
      for (int k = -1; k <= 1; ++k)
        for (int j = -1; j <= 1; ++j)
          for (int i = -1; i <= 1; ++i)
            if (i * i + j * j + k * k == distance) at.push_back({i, j, k});
    const auto w = static_cast<std::ptrdiff_t>(size[0]), h = static_cast<std::ptrdiff_t>(size[1]);
    for (std::size_t n = 0; n < at.size(); ++n) {
      offset[n] = at[n][0] + w * (at[n][1] + h * at[n][2]);
      for (std::size_t m = 0; m < at.size(); ++m) {
        int apart = 0;
        for (std::size_t a = 0; a < 3; ++a) apart += std::abs(at[n][a] - at[m][a]);
        if (apart == 1) touching[n] |= 1u << m;
      }
    }
  }

  std::uint32_t Touching(std::uint32_t set) const {
    std::uint32_t out = 0;
    for (; set; set &= set - 1) out |= touching[static_cast<std::size_t>(std::countr_zero(set))];
    return out;
  }

  // Whether the outside that a voxel sees is one piece: then taking the voxel makes no tunnel. It
  // sees face neighbours, from these edge neighbours, and from those corners (the geodesic
  // neighbourhood of order 3 for a 6-connected outside of an 18-connected solid).
  bool SeesOnePiece(const std::uint8_t* outside) const {
    constexpr std::uint32_t kFaces = 0x3f, kEdges = 0xfff << 6;
    std::uint32_t mask = 0;
    for (std::size_t n = 0; n < 26; ++n)
      mask |= static_cast<std::uint32_t>(outside[offset[n]]) << n;
    const std::uint32_t faces = mask & kFaces, edges = mask & kEdges & Touching(faces);
    const std::uint32_t seen = faces | edges | (mask & ~kFaces & ~kEdges & Touching(edges));
    std::uint32_t piece = faces & (~faces + 1), before = 0;
    while (piece != before) {
      const std::uint32_t fresh = piece & ~before;
      before = piece;
      piece |= Touching(fresh) & seen;
    }
    return faces && (faces & ~piece) == 0;
  }
};

// Lets the outside go on into free voxels, nearest first. The border voxels of the box are outside.
void Advance(const VoxelSet& solid, int depth, VoxelSet& outside) {
  const Neighbourhood near(solid.size);
  std::vector<std::uint8_t> steps(solid.inside.size(), 0);  // from the outside; 0: not met yet
  std::vector<std::size_t> queue;
  const auto meet = [&](std::size_t v, int n) {
    if (n > depth || solid.inside[v] || outside.inside[v] || steps[v]) return;
    steps[v] = static_cast<std::uint8_t>(n);
    queue.push_back(v);
  };
  for (std::size_t v = 0; v < outside.inside.size(); ++v) {
    if (outside.inside[v] || solid.inside[v]) continue;
    for (std::size_t n = 0; n < 6; ++n)
      if (outside.inside[v + static_cast<std::size_t>(near.offset[n])]) meet(v, 1);
  }
  for (std::size_t next = 0; next < queue.size(); ++next) {
    const std::size_t v = queue[next];
    if (outside.inside[v] || !near.SeesOnePiece(&outside.inside[v])) continue;
    outside.inside[v] = 1;
    for (std::size_t n = 0; n < 26; ++n) {
      const std::size_t to = v + static_cast<std::size_t>(near.offset[n]);
      // What was refused before may be taken now.
      if (steps[to] && !outside.inside[to]) queue.push_back(to);
      if (n < 6) meet(to, steps[v] + 1);
    }
  }
}

}  // namespace

VoxelSet InnerSpaces(const VoxelSet& solid, const ExteriorOptions& options) {
  assert(options.leak_radius >= 0 && options.leak_radius <= kMostRadius);
  assert(options.depth >= 0 && options.depth <= 250);
  VoxelSet out{solid.size, std::vector<std::uint8_t>(solid.inside.size())};
  const Crop crop = CropAround(solid, static_cast<std::size_t>(options.leak_radius) + 2);
  if (crop.set.inside.empty()) return out;
  VoxelSet outside = ReachedByBall(crop.set, options.leak_radius);
  VoxelSet closed = Chambers(crop.set, outside, options.leak_radius);
  for (std::size_t v = 0; v < closed.inside.size(); ++v) closed.inside[v] |= crop.set.inside[v];
  Advance(closed, options.depth, outside);
  const auto& box = crop.set;
  for (std::size_t k = 0; k < box.size[2]; ++k)
    for (std::size_t j = 0; j < box.size[1]; ++j)
      for (std::size_t i = 0; i < box.size[0]; ++i) {
        const std::size_t v = box.index(i, j, k);
        if (outside.inside[v] || box.inside[v]) continue;
        const std::array<std::ptrdiff_t, 3> at{static_cast<std::ptrdiff_t>(i) + crop.low[0],
                                               static_cast<std::ptrdiff_t>(j) + crop.low[1],
                                               static_cast<std::ptrdiff_t>(k) + crop.low[2]};
        bool there = true;
        for (int a = 0; a < 3; ++a)
          there &= at[a] >= 0 && at[a] < static_cast<std::ptrdiff_t>(solid.size[a]);
        if (there)
          out.inside[solid.index(static_cast<std::size_t>(at[0]), static_cast<std::size_t>(at[1]),
                                 static_cast<std::size_t>(at[2]))] = 1;
      }
  return out;
}

}  // namespace scan
