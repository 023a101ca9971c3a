#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <limits>
#include <vector>

#include "reconstruction/dem/fill/dem_fill.h"
#include "reconstruction/dem/fill/holdout_mask.h"
#include "terrain/relief/fractal_field.h"
#include "test/support/margin.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::fill_shadow_test {
namespace {

using testing::proof_size;

constexpr float none = std::numeric_limits<float>::quiet_NaN();

// Raster lit by parallel lines, and the samples that they leave hidden.
struct Lit {
  glm::ivec2 size{0};
  glm::dvec2 step_m{1, -1};
  std::vector<float> truth_m, heights_m, most_m;
  std::vector<std::int32_t> numbers;
  std::vector<std::uint32_t> hidden;

  std::size_t at(glm::ivec2 p) const {
    return static_cast<std::size_t>(p.y) * static_cast<std::size_t>(size.x) +
           static_cast<std::size_t>(p.x);
  }
  bool is_in(glm::ivec2 p) const { return p.x >= 0 && p.y >= 0 && p.x < size.x && p.y < size.y; }
  ThinPlateRaster raster() const { return {size, step_m, heights_m, numbers}; }
};

// Highest line over a sample that is blocked by terrain before it, by exhaustive search.
double line_m(const Lit& lit, std::span<const float> heights_m, glm::ivec2 p, glm::ivec2 way,
              double fall) {
  double most_m = -std::numeric_limits<double>::infinity();
  const double step_m = fall * glm::length(glm::dvec2(way) * lit.step_m);
  int steps = 1;
  for (glm::ivec2 q = p - way; lit.is_in(q); q -= way, ++steps)
    most_m = std::fmax(most_m, heights_m[lit.at(q)] - steps * step_m);
  return most_m;
}

Lit light_up(glm::ivec2 size, glm::dvec2 step_m, std::vector<float> truth_m, glm::ivec2 way,
             double fall) {
  Lit lit{.size = size, .step_m = step_m};
  lit.truth_m = std::move(truth_m);
  lit.heights_m = lit.truth_m;
  lit.most_m.assign(lit.truth_m.size(), none);
  lit.numbers.assign(lit.truth_m.size(), known_sample);
  for (int row = 0; row < size.y; ++row) {
    for (int column = 0; column < size.x; ++column) {
      const std::size_t i = lit.at({column, row});
      const double over_m = line_m(lit, lit.truth_m, {column, row}, way, fall);
      if (!(over_m > lit.truth_m[i])) continue;
      lit.heights_m[i] = none;
      lit.most_m[i] = static_cast<float>(over_m);
      lit.numbers[i] = 0;
      lit.hidden.push_back(static_cast<std::uint32_t>(i));
    }
  }
  return lit;
}

std::vector<float> fractal_ground(int size, std::uint64_t seed) {
  const auto field =
      fractal_field({.rms_m = 8, .hurst = 0.8, .shortest_m = 2, .longest_m = 128, .seed = {seed}},
                    {size, size}, {1, 1});
  return {field.begin(), field.end()};
}

// Flat ground with a wall 6 m high along the rows.
std::vector<float> walled(glm::ivec2 size) {
  std::vector<float> heights_m;
  for (int row = 0; row < size.y; ++row)
    for (int column = 0; column < size.x; ++column) heights_m.push_back(column == 10 ? 6.f : 0.f);
  return heights_m;
}

TEST(FillShadow, RecoversTheGrazingLinesOverTheShadowOfAWall) {
  for (const glm::dvec2 step_m : {glm::dvec2(1, -1), glm::dvec2(0.5, 2)}) {
    const Lit lit = light_up({64, 16}, step_m, walled({64, 16}), {1, 0}, 0.3);
    ASSERT_FALSE(lit.hidden.empty());
    const auto sight = sight_over(lit.raster(), lit.most_m, lit.hidden);
    ASSERT_TRUE(sight);
    EXPECT_NEAR(sight->ahead.x, 1, 1e-6);
    EXPECT_NEAR(sight->fall, 0.3, 1e-5);
    EXPECT_NEAR(sight->above_m, 0, 1e-5);
  }
}

TEST(FillShadow, GapsBetweenBeamsAreNoShadows) {
  // On flat ground the next beam passes 3 m above the beginning of the gap and lands at its end.
  Lit lit = light_up({64, 16}, {1, -1}, std::vector<float>(1024, 0), {1, 0}, 0.3);
  for (int row = 4; row < 12; ++row) {
    for (int column = 20; column < 30; ++column) {
      const std::size_t i = lit.at({column, row});
      lit.numbers[i] = 0;
      lit.most_m[i] = 0.3f * static_cast<float>(30 - column);
      lit.hidden.push_back(static_cast<std::uint32_t>(i));
    }
  }
  EXPECT_FALSE(sight_over(lit.raster(), lit.most_m, lit.hidden));
  std::ranges::fill(lit.most_m, none);
  EXPECT_FALSE(sight_over(lit.raster(), lit.most_m, lit.hidden));
}

TEST(FillShadow, CastsShadowsOnOtherGround) {
  const Lit lit = light_up({64, 64}, {1, -1}, fractal_ground(64, 3), {1, 1}, 0.4);
  const GrazingSight sight{.ahead = glm::normalize(glm::dvec2(1, 1)), .fall = 0.4, .above_m = 0.5};
  const glm::ivec2 ways[] = {{-1, -1}, {0, -1}, {-1, 0}, {1, -1}, {-1, 1}};
  std::vector<glm::ivec2> found;
  for (std::uint32_t turn = 0; turn < 5; ++turn) {
    // Boxes so large that only they and the two before them matter.
    const CastShadow shadow = cast_shadow(lit.raster(), sight, turn, {0, 0}, {63, 63});
    ASSERT_EQ(shadow.samples.size(), shadow.most_m.size());
    for (const glm::ivec2 way : ways) {
      std::size_t k = 0;
      bool is_same = true;
      for (int row = 0; row < 64 && is_same; ++row) {
        for (int column = 0; column < 64 && is_same; ++column) {
          const glm::ivec2 p(column, row);
          const double over_m = line_m(lit, lit.heights_m, p, way, 0.4);
          if (!(over_m > lit.heights_m[lit.at(p)])) continue;
          is_same = k < shadow.samples.size() && shadow.samples[k] == p &&
                    std::abs(shadow.most_m[k] - (over_m + 0.5)) < 1e-5;
          ++k;
        }
      }
      if (is_same && k == shadow.samples.size()) found.push_back(way);
    }
  }
  EXPECT_THAT(found, ::testing::UnorderedElementsAreArray(ways));
}

TEST(FillShadowProof, StatedSdsAreCorrectInShadowsUnderBounds) {
  double squares = 0, free_m2 = 0, held_m2 = 0, within_1sd = 0, within_2sd = 0, all = 0;
  const auto rounds = static_cast<std::uint64_t>(proof_size(8, 40));
  for (std::uint64_t seed = 1; seed <= rounds; ++seed) {
    const glm::ivec2 way = seed % 2 == 0 ? glm::ivec2(1, 0) : glm::ivec2(-1, 1);
    const Lit lit = light_up({128, 128}, {1, -1}, fractal_ground(128, seed), way, 0.5);
    const GridFrame frame{
        .samples = lit.size, .step_m = lit.step_m, .cells_per_m = 1.0 / lit.step_m};
    const FillOptions options{.farthest_m = 1000, .largest_share = 1};
    const FilledHeights free = fill_dem(frame, lit.heights_m, {}, options);
    const FilledHeights held = fill_dem(frame, lit.heights_m, lit.most_m, options);
    for (const std::uint32_t i : lit.hidden) {
      if (std::isnan(held.heights_m[i])) continue;  // at the edge
      const double error_m = double{held.heights_m[i]} - lit.truth_m[i];
      const double sds = std::abs(error_m) / held.sd_m[i];
      squares += sds * sds;
      within_1sd += sds <= 1 ? 1 : 0;
      within_2sd += sds <= 2 ? 1 : 0;
      held_m2 += error_m * error_m;
      free_m2 += std::pow(double{free.heights_m[i]} - lit.truth_m[i], 2);
      ++all;
    }
  }
  const double rms = std::sqrt(squares / all), gain = std::sqrt(held_m2 / free_m2);
  EXPECT_GE(rms, 0.85);
  EXPECT_LE(rms, 1.15);
  EXPECT_LE(gain, 0.97);
  testing::record_margin("errors in shadows in stated sds", rms, 1.15);
  testing::record_margin("errors in shadows by bounds and trials", gain, 0.97);
  RecordProperty("within 1 and 2 sd",
                 std::to_string(within_1sd / all) + " " + std::to_string(within_2sd / all));
}

}  // namespace
}  // namespace groundray::fill_shadow_test
