#include "reconstruction/dem/dem_fill.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <limits>
#include <random>
#include <string>

#include "core/error.h"
#include "reconstruction/dem/mesh_fill.h"
#include "terrain/fractal_field.h"
#include "test/support/margin.h"
#include "test/support/sample_terrain.h"

namespace groundray {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr float none = std::numeric_limits<float>::quiet_NaN();

GridFrame frame_of(glm::ivec2 samples, glm::dvec2 step_m = {1, -1}) {
  return {.samples = samples, .origin_m = {5, 7}, .step_m = step_m, .cells_per_m = 1.0 / step_m};
}

// The number of a sample of a raster, counted row by row.
std::size_t index_of(int column, int row, int columns) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
         static_cast<std::size_t>(column);
}

std::vector<float> sampled(glm::ivec2 samples, const std::function<double(int, int)>& height_m) {
  std::vector<float> heights_m;
  for (int row = 0; row < samples.y; ++row)
    for (int column = 0; column < samples.x; ++column)
      heights_m.push_back(static_cast<float>(height_m(column, row)));
  return heights_m;
}

// The heights without those where `is_gone`.
std::vector<float> without(std::vector<float> heights_m, glm::ivec2 samples,
                           const std::function<bool(int, int)>& is_gone) {
  for (int row = 0; row < samples.y; ++row)
    for (int column = 0; column < samples.x; ++column)
      if (is_gone(column, row)) heights_m[index_of(column, row, samples.x)] = none;
  return heights_m;
}

bool in_disc(int column, int row, int x, int y, double radius) {
  return std::hypot(column - x, row - y) <= radius;
}

std::vector<float> fractal_ground(int size, std::uint64_t seed) {
  const auto field =
      fractal_field({.rms_m = 8, .hurst = 0.8, .shortest_m = 2, .longest_m = 256, .seed = {seed}},
                    {size, size}, {1, 1});
  return {field.begin(), field.end()};
}

// What a surface has the least of, by its definition, where no sample is missing.
double energy(const std::vector<double>& z, glm::ivec2 n, glm::dvec2 step_m,
              const PlateForm& form) {
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

// How the energy rises with the height of a sample: exact for a quadratic but for rounding.
double slope_of(const std::vector<double>& z, std::size_t at, glm::ivec2 n, glm::dvec2 step_m,
                const PlateForm& form) {
  std::vector<double> low = z, high = z;
  low[at] -= 1;
  high[at] += 1;
  return (energy(high, n, step_m, form) - energy(low, n, step_m, form)) / 2;
}

constexpr PlateForm all_forms[] = {{0, 0}, {0.05, 0}, {0.3, 0}, {0, 1}, {0, 50}, {0.1, 2}};

TEST(DemFill, MeetsQuadraticSurfacesExactlyWithoutTension) {
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
      const FilledHeights filled = fill_dem(frame_of(size, step_m), holed_m, {},
                                            {.largest_share = 1, .form = PlateForm{0, smoothness}});
      double largest_m = 0;
      for (const float z : filled.heights_m) ASSERT_FALSE(std::isnan(z));
      for (std::size_t i = 0; i < truth_m.size(); ++i)
        largest_m = std::max(largest_m, std::abs(double{filled.heights_m[i]} - truth_m[i]));
      EXPECT_LE(largest_m, tolerance_m) << smoothness;
      testing::record_margin("filling a quadratic surface", largest_m, tolerance_m, "m");
    }
  }
}

TEST(DemFill, LeavesTheLeastOfWhatTheFormTells) {
  constexpr glm::ivec2 size(24, 20);
  const auto truth_m = fractal_ground(32, 3);
  auto ground_m = sampled(size, [&](int c, int r) { return truth_m[index_of(c, r, 32)]; });
  const auto holed_m = without(ground_m, size, [](int c, int r) {
    return in_disc(c, r, 8, 9, 4.5) || in_disc(c, r, 16, 11, 3) || (c == 20 && r < 19 && r > 1);
  });
  for (const glm::dvec2 step_m : {glm::dvec2(1, -1), glm::dvec2(3, -2)}) {
    for (const PlateForm& form : all_forms) {
      const FilledHeights filled =
          fill_dem(frame_of(size, step_m), holed_m, {}, {.largest_share = 1, .form = form});
      const std::vector<double> z(filled.heights_m.begin(), filled.heights_m.end());
      for (std::size_t i = 0; i < z.size(); ++i) {
        if (!std::isnan(holed_m[i])) {
          EXPECT_EQ(filled.heights_m[i], holed_m[i]);
          continue;
        }
        // Floats of up to 32 m are off by 2e-6 m; a sample's equation sums up some 500 of that.
        const double stiff = 50 + 500 * form.smoothness;
        EXPECT_NEAR(slope_of(z, i, size, step_m, form), 0, 4e-6 * stiff) << form.tension;
      }
    }
  }
}

TEST(DemFill, UnderBoundsLeavesTheLeastOfWhatIsBelowThem) {
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
    const PlateForm form = all_forms[round % 6];
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
        EXPECT_LE(slope, tolerance);  // it would rise if it might
      } else {
        EXPECT_FALSE(held.heights_m[i] > most_m[i]);
        EXPECT_NEAR(slope, 0, tolerance);
      }
    }
    EXPECT_GT(at_bound, 10u);
    std::size_t told = 0;
    for (const RasterHole& hole : held.holes) {
      told += hole.at_bound;
      EXPECT_TRUE(hole.is_least);
    }
    EXPECT_EQ(told, at_bound);
  }
}

TEST(DemFill, TellsWhichHolesStayAndWhy) {
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
  // The hull leaves of the corner only what is beyond a line from (0, 30) to (3, 39).
  const FilledHeights hull = fill_dem(frame_of(size), holed_m, {}, {.reach = FillReach::Hull});
  for (int row = 31; row < 40; ++row) {
    for (int column = 0; column < 3; ++column) {
      const bool is_inside = 9 * column >= 3 * (row - 30);
      EXPECT_EQ(std::isnan(hull.heights_m[index_of(column, row, 60)]), !is_inside);
    }
  }
}

TEST(DemFill, HolesThatStayHaveNoInfluence) {
  constexpr glm::ivec2 size(40, 40);
  const auto holed_m =
      without(sampled(size, [](int c, int r) { return c - r; }), size, [](int c, int r) {
        return in_disc(c, r, 20, 20, 3) || (r < 17 && c > 19 && c < 22) || c == 0;
      });
  const FilledHeights filled = fill_dem(frame_of(size), holed_m, {}, {});
  for (std::size_t i = 0; i < holed_m.size(); ++i) {
    if (std::isnan(filled.heights_m[i])) {
      EXPECT_TRUE(std::isnan(holed_m[i]));
      EXPECT_TRUE(std::isnan(filled.sd_m[i]));
    }
  }
}

TEST(DemFill, StatedSdsHoldOnFractalGround) {
  // Six rasters of some 40 holes; the errors within one hole go together, so shares differ by 0.05.
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

TEST(DemFill, ChoosesTheFormThatTheGroundAsksFor) {
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

TEST(DemFill, GivesTheSameBytesForAnyNumberOfThreads) {
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

TEST(DemFillProof, TakesNoMoreThanASecondFor100000Samples) {
  const int side = static_cast<int>(testing::proof_size(256, 1024));
  const std::size_t most = testing::proof_size(10'000, 100'000);
  auto holed_m = fractal_ground(side, 6);
  std::mt19937 random(6);
  std::size_t hidden = 0;
  while (hidden < most) {
    const int x = 24 + static_cast<int>(random() % static_cast<unsigned>(side - 48)),
              y = 24 + static_cast<int>(random() % static_cast<unsigned>(side - 48));
    const double radius = 1 + static_cast<double>(random() % 200) / 10;
    for (int row = y - 20; row <= y + 20; ++row) {
      for (int column = x - 20; column <= x + 20; ++column) {
        float& z = holed_m[index_of(column, row, side)];
        if (!in_disc(column, row, x, y, radius) || std::isnan(z)) continue;
        z = none;
        ++hidden;
      }
    }
  }
  const std::clock_t begin = std::clock();
  const FilledHeights filled = fill_dem(frame_of({side, side}), holed_m, {}, {.largest_share = 1});
  const double cpu_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  EXPECT_EQ(filled.filled, hidden);
  EXPECT_LE(cpu_s, 1);
  testing::record_margin("CPU time of filling 100 000 samples", cpu_s, 1, "s");
}

TEST(DemFill, TakesOddRasters) {
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

TEST(DemFill, RefusesWhatIsNoDem) {
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
  const std::string all =
      message({2, 2}, flat, {}, {.farthest_m = -1, .largest_share = 0, .form = PlateForm{1, -1}});
  for (const char* fault :
       {"farthest_m = -1", "largest_share = 0", "tension = 1", "smoothness = -1"})
    EXPECT_THAT(all, HasSubstr(fault));
  std::vector<float> holed = fractal_ground(64, 1);
  for (std::size_t i = 1000; i < 1020; ++i) holed[i] = none;
  EXPECT_THROW((void)fill_dem(frame_of({64, 64}), holed, {}, {}, {.most_bytes = 1000}), Error);
}

TEST(MeshFill, MeetsPlanesAndTellsWhatItLeaves) {
  constexpr glm::ivec2 size(40, 30);
  const auto truth_m = sampled(size, [](int c, int r) { return 2.0 + 0.25 * c - 0.5 * r; });
  const auto holed_m = without(truth_m, size, [](int c, int r) {
    return in_disc(c, r, 12, 12, 5) || in_disc(c, r, 30, 15, 2) || (c == 3 && r == 3);
  });
  for (const glm::dvec2 step_m : {glm::dvec2(1, -1), glm::dvec2(0.5, 2)}) {
    const FilledHeights filled = fill_dem_by_mesh(frame_of(size, step_m), holed_m, {}, 1000);
    for (const RasterHole& hole : filled.holes) EXPECT_EQ(hole.fate, HoleFate::Filled);
    for (std::size_t i = 0; i < truth_m.size(); ++i)
      EXPECT_NEAR(filled.heights_m[i], truth_m[i], 1e-5);  // of fairing's solver
  }
  const FilledHeights few = fill_dem_by_mesh(frame_of(size), holed_m, {}, 20);
  ASSERT_THAT(few.holes, SizeIs(3));
  EXPECT_EQ(few.holes[0].fate, HoleFate::Filled);
  EXPECT_EQ(few.holes[1].fate, HoleFate::Partly);
}

TEST(MeshFill, ComesNearAThinPlateAlsoOnVerySteepGround) {
  constexpr glm::ivec2 size(128);
  for (const float steeper : {1.f, 100.f}) {
    auto truth_m = fractal_ground(128, 4);
    for (float& z : truth_m) z *= steeper;
    const auto holed_m =
        without(truth_m, size, [](int c, int r) { return in_disc(c % 32, r % 32, 16, 16, 5); });
    const auto rms_m = [&](const FilledHeights& filled) {
      double sum = 0, count = 0;
      for (std::size_t i = 0; i < truth_m.size(); ++i) {
        if (!std::isnan(holed_m[i])) continue;
        EXPECT_FALSE(std::isnan(filled.heights_m[i]));
        sum += std::pow(filled.heights_m[i] - truth_m[i], 2);
        ++count;
      }
      return std::sqrt(sum / count);
    };
    const double plate_m = rms_m(fill_dem(frame_of(size), holed_m, {}, {.form = PlateForm{}}));
    const double mesh_m = rms_m(fill_dem_by_mesh(frame_of(size), holed_m, {}, 1000));
    EXPECT_LT(mesh_m, 1.15 * plate_m);  // measured elsewhere: equal within 2 %
  }
}

}  // namespace
}  // namespace groundray
