#include "reconstruction/volume/voxel_set.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <numeric>

namespace scan {
namespace {

// into = into | from, or into & from; eight voxels at a time, as compilers do not at -O2.
void Combine(const std::uint8_t* from, std::size_t count, bool grow, std::uint8_t* into) {
  std::size_t n = 0;
  for (; n + 8 <= count; n += 8) {
    std::uint64_t a, b;
    std::memcpy(&a, from + n, 8);
    std::memcpy(&b, into + n, 8);
    b = grow ? a | b : a & b;
    std::memcpy(into + n, &b, 8);
  }
  for (; n < count; ++n)
    into[n] = static_cast<std::uint8_t>(grow ? into[n] | from[n] : into[n] & from[n]);
}

// Running window along one axis: any of its voxels for `grow`, else all. Voxels outside of the
// volume are left out.
VoxelSet WindowAlong(const VoxelSet& set, int axis, int radius, bool grow) {
  VoxelSet out = set;
  const std::size_t w = set.size[0], h = set.size[1], d = set.size[2];
  const std::size_t r = static_cast<std::size_t>(radius);
  tbb::parallel_for(std::size_t{0}, d, [&](std::size_t k) {
    for (std::size_t j = 0; j < h; ++j) {
      std::uint8_t* into = &out.inside[set.index(0, j, k)];
      if (axis == 0) {
        const std::uint8_t* row = &set.inside[set.index(0, j, k)];
        for (std::size_t s = 1; s <= std::min(r, w - 1); ++s) {
          Combine(row + s, w - s, grow, into);
          Combine(row, w - s, grow, into + s);
        }
        continue;
      }
      const std::size_t at = axis == 1 ? j : k, last = (axis == 1 ? h : d) - 1;
      for (std::size_t n = at > r ? at - r : 0; n <= std::min(at + r, last); ++n)
        if (n != at)
          Combine(&set.inside[axis == 1 ? set.index(0, n, k) : set.index(0, j, n)], w, grow, into);
    }
  });
  return out;
}

VoxelSet Windowed(const VoxelSet& set, int radius, bool grow) {
  if (radius <= 0 || set.inside.empty()) return set;
  VoxelSet out = WindowAlong(set, 0, radius, grow);
  out = WindowAlong(out, 1, radius, grow);
  return WindowAlong(out, 2, radius, grow);
}

// A row's stretch [begin, end) of voxels inside.
struct Run {
  std::uint32_t begin, end;
};

struct Runs {
  std::vector<Run> runs;
  std::vector<std::size_t> first;  // of each row; one more at the end
};

Runs FindRuns(const VoxelSet& set) {
  Runs found;
  const std::size_t rows = set.size[1] * set.size[2];
  found.first.reserve(rows + 1);
  for (std::size_t row = 0; row < rows; ++row) {
    found.first.push_back(found.runs.size());
    const std::uint8_t* p = set.inside.data() + row * set.size[0];
    for (std::size_t i = 0; i < set.size[0];) {
      if (!p[i]) {
        ++i;
        continue;
      }
      const std::size_t begin = i;
      while (i < set.size[0] && p[i]) ++i;
      found.runs.push_back({static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(i)});
    }
  }
  found.first.push_back(found.runs.size());
  return found;
}

std::uint32_t Root(std::vector<std::uint32_t>& parent, std::uint32_t v) {
  while (parent[v] != v) v = parent[v] = parent[parent[v]];
  return v;
}

void JoinRows(const Runs& r, std::size_t row, std::size_t other, std::uint32_t reach,
              std::vector<std::uint32_t>& parent) {
  std::size_t a = r.first[row], b = r.first[other];
  while (a < r.first[row + 1] && b < r.first[other + 1]) {
    if (r.runs[a].begin < r.runs[b].end + reach && r.runs[b].begin < r.runs[a].end + reach) {
      const auto ra = Root(parent, static_cast<std::uint32_t>(a));
      const auto rb = Root(parent, static_cast<std::uint32_t>(b));
      parent[std::max(ra, rb)] = std::min(ra, rb);
    }
    if (r.runs[a].end < r.runs[b].end)
      ++a;
    else
      ++b;
  }
}

}  // namespace

std::size_t Count(const VoxelSet& set) {
  return std::accumulate(set.inside.begin(), set.inside.end(), std::size_t{0});
}

VoxelSet Dilated(const VoxelSet& set, int radius) { return Windowed(set, radius, true); }
VoxelSet Eroded(const VoxelSet& set, int radius) { return Windowed(set, radius, false); }

Labelling LabelComponents(const VoxelSet& set, Connectivity connectivity) {
  const Runs r = FindRuns(set);
  std::vector<std::uint32_t> parent(r.runs.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const std::size_t h = set.size[1], d = set.size[2];
  const bool edges = connectivity != Connectivity::faces;
  const std::uint32_t reach = edges ? 1 : 0;
  const std::uint32_t diagonal_reach = connectivity == Connectivity::corners ? 1 : 0;
  for (std::size_t k = 0; k < d; ++k)
    for (std::size_t j = 0; j < h; ++j) {
      const std::size_t row = j + h * k;
      if (j > 0) JoinRows(r, row, row - 1, reach, parent);
      if (k > 0) JoinRows(r, row, row - h, reach, parent);
      if (edges && k > 0 && j > 0) JoinRows(r, row, row - h - 1, diagonal_reach, parent);
      if (edges && k > 0 && j + 1 < h) JoinRows(r, row, row - h + 1, diagonal_reach, parent);
    }
  Labelling out;
  out.label.assign(set.inside.size(), 0);
  std::vector<std::uint32_t> label(r.runs.size(), 0);
  for (std::size_t row = 0; row < h * d; ++row) {
    const std::size_t j = row % h, k = row / h;
    for (std::size_t n = r.first[row]; n < r.first[row + 1]; ++n) {
      const std::uint32_t root = Root(parent, static_cast<std::uint32_t>(n));
      if (!label[root]) {
        out.components.emplace_back();
        label[root] = static_cast<std::uint32_t>(out.components.size());
      }
      label[n] = label[root];
      Component& c = out.components[label[n] - 1];
      const Run run = r.runs[n];
      c.voxels += run.end - run.begin;
      c.side_wall |= run.begin == 0 || run.end == set.size[0] || j == 0 || j + 1 == h;
      c.any_wall |= c.side_wall || k == 0 || k + 1 == d;
      std::fill_n(out.label.begin() + static_cast<std::ptrdiff_t>(row * set.size[0] + run.begin),
                  run.end - run.begin, label[n]);
    }
  }
  return out;
}

std::ptrdiff_t LargestOf(const Labelling& labelling) {
  const auto& all = labelling.components;
  if (all.empty()) return -1;
  return std::max_element(
             all.begin(), all.end(),
             [](const Component& a, const Component& b) { return a.voxels < b.voxels; }) -
         all.begin();
}

VoxelSet EnclosedCavities(const VoxelSet& set) {
  VoxelSet air{set.size, std::vector<std::uint8_t>(set.inside.size())};
  for (std::size_t v = 0; v < air.inside.size(); ++v) air.inside[v] = !set.inside[v];
  const Labelling labelling = LabelComponents(air, Connectivity::faces);
  for (std::size_t v = 0; v < air.inside.size(); ++v)
    if (air.inside[v]) air.inside[v] = !labelling.components[labelling.label[v] - 1].any_wall;
  return air;
}

}  // namespace scan
