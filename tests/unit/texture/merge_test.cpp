#include "reconstruction/texture/merge.h"

#include <gtest/gtest.h>

#include <cmath>

#include "drivers/base/rng.h"
#include "reconstruction/texture/fill.h"
#include "reconstruction/texture/texture.h"

namespace scan {
namespace {

constexpr int kSide = 60;

// A flat sheet of kSide x kSide texels in one chart.
Texels Sheet() {
  Texels texels;
  texels.size_px = kSide;
  for (int i = 0; i < kSide * kSide; ++i) {
    const int x = i % kSide, y = i / kSide;
    texels.place.push_back(i);
    texels.position.emplace_back(x, y, 0);
    texels.normal.emplace_back(0, 0, 1);
    texels.area_mm2.push_back(1);
    texels.side_mm.push_back(1);
    texels.beside.push_back({x + 1 < kSide ? i + 1 : -1, y + 1 < kSide ? i + kSide : -1,
                             x > 0 ? i - 1 : -1, y > 0 ? i - kSide : -1});
  }
  texels.link_begin.assign(texels.size() + 1, 0);
  return texels;
}

// Shows columns [from, to).
Layer Stripe(int from, int to, std::uint16_t view, float cosine, std::uint64_t seed,
             bool agrees_along_a_wave) {
  Layer layer = MakeLayer(kSide * kSide);
  Rng rng(seed);
  for (int i = 0; i < kSide * kSide; ++i) {
    const int x = i % kSide, y = i / kSide;
    const auto noise = static_cast<std::uint16_t>(rng.Below(30000));
    if (x < from || x >= to) continue;
    const bool wave = std::abs(x - 30 - 8 * std::sin(0.2 * y)) < 2.5;
    const std::uint16_t value = agrees_along_a_wave && wave ? 20000 : 20000 + noise;
    layer.colour[i] = Colour16::all(value);
    layer.cosine[i] = cosine;
    layer.view[i] = view;
    layer.kind[i] = static_cast<std::uint16_t>(TexelClass::measured);
  }
  return layer;
}

TEST(MergeBySeam, FollowsWhereThePhotographsAgree) {
  const Texels texels = Sheet();
  const Layer first = Stripe(0, 45, 0, 0.8f, 1, true);
  const Layer second = Stripe(15, kSide, 1, 0.8f, 2, true);
  Layer result = first;
  const SeamSummary seam = MergeBySeam(texels, second, 0, result);
  EXPECT_GE(seam.pairs, static_cast<std::size_t>(kSide));
  EXPECT_LT(seam.cost, 1e-3);  // a straight seam crosses the noise
  for (int i = 0; i < kSide * kSide; ++i) {
    const double edge = 30 + 8 * std::sin(0.2 * (i / kSide));
    EXPECT_TRUE(i % kSide >= edge - 4 || result.view[i] == 0);
    EXPECT_TRUE(i % kSide <= edge + 4 || result.view[i] == 1);
  }
}

TEST(MergeBySeam, CostsNoMoreThanTheBestStraightSeam) {
  const Texels texels = Sheet();
  const Layer first = Stripe(0, 45, 0, 0.8f, 3, false);
  const Layer second = Stripe(15, kSide, 1, 0.8f, 4, false);
  double straight = 1e9;
  for (int x = 15; x < 44; ++x) {
    double cost = 0;
    for (int y = 0; y < kSide; ++y) {
      for (const int i : {y * kSide + x, y * kSide + x + 1}) {
        cost += std::sqrt(3.0) *
                std::abs(static_cast<double>(first.colour[i][0]) - second.colour[i][0]) / 65535;
      }
    }
    straight = std::min(straight, cost);
  }
  Layer result = first;
  EXPECT_LT(MergeBySeam(texels, second, 0, result).cost, straight);
}

TEST(MergeBySeam, EqualColoursGoToTheSquarerView) {
  const Texels texels = Sheet();
  Layer first = Stripe(0, 45, 0, 0.3f, 1, false);
  Layer second = Stripe(15, kSide, 1, 0.9f, 1, false);
  for (auto* layer : {&first, &second}) {
    for (Colour16& colour : layer->colour) colour = Colour16::all(30000);
  }
  Layer result = first;
  MergeBySeam(texels, second, 2, result);
  for (int i = 0; i < kSide * kSide; ++i) {
    EXPECT_EQ(result.view[i], i % kSide < 16 ? 0 : 1) << i % kSide;  // hard link at column 15
    EXPECT_NEAR(result.colour[i][0], 30000, 30);
  }
}

TEST(FillUnseen, GrowsAcrossSeamLinksAndMarksWhatItFilled) {
  Texels texels = Sheet();
  for (int y = 0; y < kSide; ++y) {  // the sheet cut between columns 29 and 30, linked instead
    texels.beside[y * kSide + 29][0] = -1;
    texels.beside[y * kSide + 30][2] = -1;
  }
  for (std::size_t i = 0; i < texels.size(); ++i) {
    const int x = static_cast<int>(i) % kSide;
    texels.link_begin[i] = static_cast<std::int32_t>(texels.link.size());
    if (x == 29) texels.link.push_back(static_cast<std::int32_t>(i) + 1);
    if (x == 30) texels.link.push_back(static_cast<std::int32_t>(i) - 1);
  }
  texels.link_begin.back() = static_cast<std::int32_t>(texels.link.size());
  Layer result = Stripe(0, 20, 0, 0.8f, 1, false);
  for (Colour16& colour : result.colour) colour = Colour16(10000, 20000, 30000);
  FillUnseen(texels, 10, result);
  for (int i = 0; i < kSide * kSide; ++i) {
    const bool seen = i % kSide < 20;
    EXPECT_EQ(result.kind[i] == static_cast<std::uint16_t>(TexelClass::filled), !seen);
    EXPECT_EQ(result.view[i] == kNoView, !seen);
    EXPECT_NEAR(result.colour[i][2], 30000, 60);
  }
}

}  // namespace
}  // namespace scan
