#include "reconstruction/dem/fill/dem_fill.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <random>
#include <string>

#include "core/error.h"
#include "test/reconstruction/dem/holed_ground.h"
#include "test/support/margin.h"

namespace groundray::dem_fill_test {
namespace {

using ::testing::Each;
using testing::fractal_ground;
using testing::frame_of;
using ::testing::HasSubstr;
using testing::in_disc;
using testing::index_of;
using testing::none;
using testing::sampled;
using testing::without;

// Energy that the filled surface minimises, by its definition, where no sample is missing.
double energy(const std::vector<double>& z, glm::ivec2 n, glm::dvec2 step_m,
              const ThinPlateEnergy& form) {
  const double dx = std::abs(step_m.x), dy = std::abs(step_m.y), h2 = dx * dy;
  const auto at = [&](int c, int r) { return z[index_of(c, r, n.x)]; };
  double sum = 0;
  const auto add = [&](double weight, double derivative) {
    sum += weight * derivative * derivative;
  };
  for (int r = 0; r < n.y; ++r) {
    for (int c = 0; c < n.x; ++c) {
      const bool x1 = c + 1 < n.x, x2 = c + 2 < n.x, x3 = c + 3 < n.x;
      const bool y1 = r + 1 < n.y, y2 = r + 2 < n.y, y3 = r + 3 < n.y;
      const double bend = 1 - form.tension, pull = form.tension / h2, turn = form.smoothness * h2;
      const auto xx = [&](int k) {
        return (at(c, r + k) - 2 * at(c + 1, r + k) + at(c + 2, r + k)) / (dx * dx);
      };
      const auto yy = [&](int k) {
        return (at(c + k, r) - 2 * at(c + k, r + 1) + at(c + k, r + 2)) / (dy * dy);
      };
      if (x1) add(pull, (at(c + 1, r) - at(c, r)) / dx);
      if (y1) add(pull, (at(c, r + 1) - at(c, r)) / dy);
      if (x2) add(bend, xx(0));
      if (y2) add(bend, yy(0));
      if (x1 && y1)
        add(2 * bend, (at(c, r) - at(c + 1, r) - at(c, r + 1) + at(c + 1, r + 1)) / (dx * dy));
      if (x3)
        add(turn, (at(c + 3, r) - 3 * at(c + 2, r) + 3 * at(c + 1, r) - at(c, r)) / (dx * dx * dx));
      if (y3)
        add(turn, (at(c, r + 3) - 3 * at(c, r + 2) + 3 * at(c, r + 1) - at(c, r)) / (dy * dy * dy));
      if (x2 && y1) add(3 * turn, (xx(1) - xx(0)) / dy);
      if (y2 && x1) add(3 * turn, (yy(1) - yy(0)) / dx);
    }
  }
  return sum;
}

// Derivative of the energy with respect to the height of a sample: exact for a quadratic, except
// for rounding.
double slope_of(const std::vector<double>& z, std::size_t at, glm::ivec2 n, glm::dvec2 step_m,
                const ThinPlateEnergy& form) {
  std::vector<double> low = z, high = z;
  low[at] -= 1;
  high[at] += 1;
  return (energy(high, n, step_m, form) - energy(low, n, step_m, form)) / 2;
}

constexpr ThinPlateEnergy all_forms[] = {{0, 0}, {0.05, 0}, {0.3, 0}, {0, 1}, {0, 50}, {0.1, 2}};

TEST(DemFill, ReproducesQuadraticSurfacesWithoutTension) {
  constexpr glm::ivec2 size(64, 48);
  constexpr double tolerance_m = 1e-6;
  for (const glm::dvec2 step_m : {glm::dvec2(1, -1), glm::dvec2(2, -0.5)}) {
    const auto truth_m = sampled(size, [](int c, int r) {
      return (c * c - 3.0 * c * r + 2.0 * r * r) / 1024 + c / 16.0 - r / 8.0 + 3;
    });
    const auto holed_m = without(truth_m, size, [](int c, int r) {
      return in_disc(c, r, 20, 22, 12) || (c > 40 && c < 44 && r > 4 && r < 44) ||
             (c + r == 60 && c > 15 && r > 3);
    });
    for (const double smoothness : {0.0, 1.0, 50.0}) {
      const FilledHeights filled =
          fill_dem(frame_of(size, step_m), holed_m, {},
                   {.largest_share = 1, .form = ThinPlateEnergy{0, smoothness}});
      double largest_m = 0;
      for (const float z : filled.heights_m) ASSERT_FALSE(std::isnan(z));
      for (std::size_t i = 0; i < truth_m.size(); ++i)
        largest_m = std::max(largest_m, std::abs(double{filled.heights_m[i]} - truth_m[i]));
      EXPECT_LE(largest_m, tolerance_m) << smoothness;
      testing::record_margin("filling a quadratic surface", largest_m, tolerance_m, "m");
    }
  }
}

TEST(DemFill, MinimisesTheEnergy) {
  constexpr glm::ivec2 size(24, 20);
  const auto truth_m = fractal_ground(32, 3);
  auto ground_m = sampled(size, [&](int c, int r) { return truth_m[index_of(c, r, 32)]; });
  const auto holed_m = without(ground_m, size, [](int c, int r) {
    return in_disc(c, r, 8, 9, 4.5) || in_disc(c, r, 16, 11, 3) || (c == 20 && r < 19 && r > 1);
  });
  for (const glm::dvec2 step_m : {glm::dvec2(1, -1), glm::dvec2(3, -2)}) {
    for (const ThinPlateEnergy& form : all_forms) {
      const FilledHeights filled =
          fill_dem(frame_of(size, step_m), holed_m, {}, {.largest_share = 1, .form = form});
      const std::vector<double> z(filled.heights_m.begin(), filled.heights_m.end());
      for (std::size_t i = 0; i < z.size(); ++i) {
        if (!std::isnan(holed_m[i])) {
          EXPECT_EQ(filled.heights_m[i], holed_m[i]);
          continue;
        }
        // Floats of up to 32 m have errors of 2e-6 m; a sample's equation sums some 500 of these.
        const double stiff = 50 + 500 * form.smoothness;
        EXPECT_NEAR(slope_of(z, i, size, step_m, form), 0, 4e-6 * stiff) << form.tension;
      }
    }
  }
}

TEST(DemFill, MinimisesTheEnergyUnderBounds) {
  constexpr glm::ivec2 size(40, 32);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (int round = 0; round < 6; ++round) {
    const auto ground_m = fractal_ground(64, 10 + static_cast<std::uint64_t>(round));
    auto truth_m = sampled(size, [&](int c, int r) { return ground_m[index_of(c, r, 64)]; });
    const auto is_gone = [](int c, int r) {
      return in_disc(c, r, 14, 15, 10) || in_disc(c, r, 32, 12, 5);
    };
    const auto holed_m = without(truth_m, size, is_gone);
    const ThinPlateEnergy form = all_forms[round % 6];
    const FilledHeights free =
        fill_dem(frame_of(size), holed_m, {}, {.largest_share = 1, .form = form});
    std::vector<float> most_m = free.heights_m;
    for (float& bound_m : most_m)
      bound_m += uniform(random) < 0.5f ? none : 4 * uniform(random) - 2;
    const FilledHeights held =
        fill_dem(frame_of(size), holed_m, most_m, {.largest_share = 1, .form = form});
    const std::vector<double> z(held.heights_m.begin(), held.heights_m.end());
    std::size_t at_bound = 0;
    for (std::size_t i = 0; i < z.size(); ++i) {
      if (!std::isnan(holed_m[i])) continue;
      const double slope = slope_of(z, i, size, {1, -1}, form);
      const double tolerance = 4e-6 * (50 + 500 * form.smoothness);
      if (held.heights_m[i] == most_m[i]) {
        ++at_bound;
        EXPECT_LE(slope, tolerance);  // without the bound it would rise
      } else {
        EXPECT_FALSE(held.heights_m[i] > most_m[i]);
        EXPECT_NEAR(slope, 0, tolerance);
      }
    }
    EXPECT_GT(at_bound, 10u);
    std::size_t reported = 0;
    for (const RasterHole& hole : held.holes) {
      reported += hole.at_bound;
      EXPECT_TRUE(hole.is_least);
    }
    EXPECT_EQ(reported, at_bound);
  }
}

TEST(DemFill, ReportsUnfilledHolesWithTheReason) {
  constexpr glm::ivec2 size(60, 40);
  const auto truth_m = sampled(size, [](int c, int r) { return 0.1 * c + 0.2 * r; });
  const auto holed_m = without(truth_m, size, [](int c, int r) {
    return in_disc(c, r, 10, 10, 2) || in_disc(c, r, 40, 20, 8) || (c < 3 && r > 30);
  });
  const auto fates = [&](const FillOptions& options) {
    std::vector<HoleFate> found;
    for (const RasterHole& hole : fill_dem(frame_of(size), holed_m, {}, options).holes)
      found.push_back(hole.fate);
    return found;
  };
  using enum HoleFate;
  EXPECT_EQ(fates({}), (std::vector{Filled, Filled, Open}));
  EXPECT_EQ(fates({.farthest_m = 5}), (std::vector{Filled, TooFar, Open}));
  EXPECT_EQ(fates({.largest_share = 0.02}), (std::vector{Filled, TooLarge, Open}));
  EXPECT_EQ(fates({.reach = FillReach::Everywhere}), (std::vector{Filled, Filled, Filled}));
  // The hull excludes only the part of the corner beyond a line from (0, 30) to (3, 39).
  const FilledHeights hull = fill_dem(frame_of(size), holed_m, {}, {.reach = FillReach::Hull});
  for (int row = 31; row < 40; ++row) {
    for (int column = 0; column < 3; ++column) {
      const bool is_inside = 9 * column >= 3 * (row - 30);
      EXPECT_EQ(std::isnan(hull.heights_m[index_of(column, row, 60)]), !is_inside);
    }
  }
}

// Unfilled holes have the same effect as the raster's edge.
TEST(DemFill, UnfilledHolesHaveNoInfluence) {
  constexpr glm::ivec2 size(40, 40);
  const auto holed_m = without(fractal_ground(64, 7), {64, 64}, [](int c, int r) {
    return in_disc(c, r, 20, 20, 6) || in_disc(c, r, 9, 30, 4) || c < 4 || c > 39 || r > 39;
  });
  const auto part_m = [&](int left) {
    return sampled({size.x - left, size.y},
                   [&](int c, int r) { return holed_m[index_of(c + left, r, 64)]; });
  };
  for (const ThinPlateEnergy& form : all_forms) {
    const FillOptions options{.largest_share = 1, .form = form};
    const FilledHeights all = fill_dem(frame_of(size), part_m(0), {}, options);
    const FilledHeights cut = fill_dem(frame_of({36, 40}), part_m(4), {}, options);
    for (int r = 0; r < 40; ++r) {
      for (int c = 0; c < 40; ++c) {
        const float z = all.heights_m[index_of(c, r, 40)];
        EXPECT_EQ(std::isnan(z), c < 4);
        if (c < 4 || !std::isnan(holed_m[index_of(c, r, 64)])) {
          EXPECT_TRUE(std::isnan(all.sd_m[index_of(c, r, 40)]));
        }
        if (c >= 4) {
          EXPECT_NEAR(z, cut.heights_m[index_of(c - 4, r, 36)], 1e-4);  // rounding in stiff forms
        }
      }
    }
  }
}

// A hole that one plate fills together with a neighbouring hole gets the standard deviation of the
// neighbour's plate form.
TEST(DemFill, HolesFilledTogetherHaveTheSdOfTheirEnergy) {
  constexpr glm::ivec2 size(128);
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0, 0.5);
  // Noise on hills: tension is best where samples are near, but not where they are far.
  const auto truth_m = sampled(size, [&](int c, int r) {
    return 10 * std::sin(c / 9.0) * std::cos(r / 11.0) + noise(random);
  });
  const auto holed_m = without(truth_m, size, [](int c, int r) {
    const bool is_small = c >= 64 && c % 6 > 3 && r % 6 > 3;
    return is_small || in_disc(c, r, 30, 30, 12) || in_disc(c, r, 30, 80, 12) ||
           (c > 43 && c < 46 && r > 29 && r < 32);
  });
  const FilledHeights filled = fill_dem(frame_of(size), holed_m, {}, {.largest_share = 1});
  const auto hole_from = [&](glm::ivec2 first) {
    return *std::ranges::find(filled.holes, first, &RasterHole::first);
  };
  const RasterHole large = hole_from({18, 18}), beside = hole_from({44, 30});
  ASSERT_NE(filled.trials[large.trial].form, filled.trials[beside.trial].form);
  EXPECT_EQ(beside.form, large.form);
  // Both samples are one cell from data, and the ground around them is the same except for two
  // columns.
  const float own = filled.sd_m[index_of(44, 30, 128)], other = filled.sd_m[index_of(42, 30, 128)];
  EXPECT_NEAR(own / other, 1, 0.03);
}

TEST(DemFill, StatedSdsAreCorrectOnFractalGround) {
  // Six rasters of some 40 holes; errors within one hole are correlated, so the fractions vary by
  // 0.05.
  double within_1sd = 0, within_2sd = 0, all = 0;
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u}) {
    constexpr glm::ivec2 size(256);
    const auto truth_m = fractal_ground(256, seed);
    std::mt19937 random(static_cast<unsigned>(seed));
    std::vector<float> holed_m = truth_m;
    for (int hole = 0; hole < 40; ++hole) {
      const int x = 12 + static_cast<int>(random() % 232),
                y = 12 + static_cast<int>(random() % 232);
      const double radius = 1 + static_cast<double>(random() % 90) / 10;
      holed_m = without(std::move(holed_m), size,
                        [&](int c, int r) { return in_disc(c, r, x, y, radius); });
    }
    const FilledHeights filled = fill_dem(frame_of(size), holed_m, {}, {});
    for (std::size_t i = 0; i < truth_m.size(); ++i) {
      if (!std::isnan(holed_m[i]) || std::isnan(filled.heights_m[i])) continue;
      const double sds = std::abs(filled.heights_m[i] - truth_m[i]) / filled.sd_m[i];
      within_1sd += sds <= 1 ? 1 : 0;
      within_2sd += sds <= 2 ? 1 : 0;
      ++all;
    }
  }
  EXPECT_NEAR(within_1sd / all, 0.683, 0.06);
  EXPECT_NEAR(within_2sd / all, 0.954, 0.03);
  RecordProperty("within 1 and 2 sd",
                 std::to_string(within_1sd / all) + " " + std::to_string(within_2sd / all));
}

TEST(DemFill, ChoosesSmoothnessOrTensionByTheGround) {
  constexpr glm::ivec2 size(128);
  const auto is_gone = [](int c, int r) { return in_disc(c % 32, r % 32, 16, 16, 5); };
  const auto smooth_m = sampled(size, [](int c, int r) {
    return 10 * std::sin(c / 9.0) * std::cos(r / 11.0) + std::sin((c + r) / 7.0);
  });
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 1);
  double height_m = 0;
  const auto rough_m = sampled(size, [&](int, int) { return height_m = noise(random); });
  const auto form_for = [&](const std::vector<float>& ground_m) {
    return fill_dem(frame_of(size), without(ground_m, size, is_gone), {}, {}).trials.at(0).form;
  };
  EXPECT_GT(form_for(smooth_m).smoothness, 0);
  EXPECT_GT(form_for(rough_m).tension, 0);
}

TEST(DemFill, SameBytesForAnyNumberOfThreads) {
  constexpr glm::ivec2 size(128);
  const auto holed_m = without(fractal_ground(128, 9), size, [](int c, int r) {
    return in_disc(c % 24, r % 40, 12, 12, c < 64 ? 3 : 5) || (c + r) % 37 < 2;
  });
  const auto run = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return fill_dem(frame_of(size), holed_m, {}, {.reach = FillReach::Everywhere});
  };
  const FilledHeights one = run(1), many = run(4);
  const auto bits = [](const std::vector<float>& values) {
    return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
  };
  EXPECT_EQ(bits(one.heights_m), bits(many.heights_m));
  EXPECT_EQ(bits(one.sd_m), bits(many.sd_m));
  EXPECT_GT(one.filled, 1000u);
}

TEST(DemFill, AcceptsRastersOfAnyShapeAndContent) {
  using enum FillReach;
  for (const FillReach reach : {Enclosed, Hull, Everywhere}) {
    const FillOptions options{.reach = reach, .largest_share = 1};
    EXPECT_NO_THROW(
        (void)fill_dem(frame_of({2, 2}), std::vector{none, 1.f, 2.f, none}, {}, options));
    EXPECT_NO_THROW((void)fill_dem(frame_of({5, 3}), std::vector<float>(15, 4), {}, options));
    std::vector<float> lone(400, none);
    lone[210] = 7;
    const FilledHeights filled = fill_dem(frame_of({20, 20}), lone, {}, options);
    if (reach == Everywhere) {
      EXPECT_THAT(filled.heights_m, Each(7));
    }
    std::mt19937 random(3);
    std::vector<float> speckled(2500);
    for (float& z : speckled) z = random() % 3 == 0 ? static_cast<float>(random() % 100) : none;
    const FilledHeights all = fill_dem(frame_of({50, 50}), speckled, {}, options);
    for (const float z : all.heights_m) EXPECT_FALSE(std::isinf(z));
    if (reach == Everywhere) {
      EXPECT_EQ(std::ranges::count_if(all.heights_m, [](float z) { return std::isnan(z); }), 0);
    }
  }
}

TEST(DemFill, RejectsInvalidDemsAndOptions) {
  const auto message = [](glm::ivec2 size, std::vector<float> heights_m, std::vector<float> most_m,
                          const FillOptions& options) -> std::string {
    try {
      (void)fill_dem(frame_of(size), heights_m, most_m, options);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const std::vector<float> flat(4, 1);
  EXPECT_THAT(message({2, 2}, {1, 1}, {}, {}), HasSubstr("2 entries for 4 samples"));
  EXPECT_THAT(message({2, 2}, std::vector<float>(4, none), {}, {}), HasSubstr("all are NaN"));
  EXPECT_THAT(message({2, 2}, {1, 1, 1, INFINITY}, {}, {}),
              HasSubstr("column 1, row 1 is infinite"));
  EXPECT_THAT(message({2, 2}, flat, {1, 2}, {}), HasSubstr("2 bounds or filled heights for 4"));
  const std::string all = message(
      {2, 2}, flat, {}, {.farthest_m = -1, .largest_share = 0, .form = ThinPlateEnergy{1, -1}});
  for (const char* fault :
       {"farthest_m = -1", "largest_share = 0", "tension = 1", "smoothness = -1"})
    EXPECT_THAT(all, HasSubstr(fault));
  std::vector<float> holed = fractal_ground(64, 1);
  for (std::size_t i = 1000; i < 1020; ++i) holed[i] = none;
  EXPECT_THROW((void)fill_dem(frame_of({64, 64}), holed, {}, {}, {.most_bytes = 1000}), Error);
}

}  // namespace
}  // namespace groundray::dem_fill_test
