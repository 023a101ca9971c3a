// Erosion against closed forms: slopes of talus, migration of a wave up a channel, and the steady
// state of uplift and incision, whose drainage is found anew here.
#include "terrain/erosion/erosion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>
#include <random>
#include <vector>

#include "core/error.h"
#include "terrain/dem/dem_io.h"
#include "terrain/erosion/stream_power.h"
#include "terrain/terrain.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/geotiff.h"

namespace groundray::erosion_test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr std::size_t plenty = std::size_t{1} << 30;
constexpr double repose_rad = 35 * std::numbers::pi / 180;

HeightGrid grid_of(glm::ivec2 size, double cell_m,
                   const std::function<double(int column, int row)>& height_m) {
  std::vector<float> heights_m;
  for (int row = 0; row < size.y; ++row) {
    for (int column = 0; column < size.x; ++column)
      heights_m.push_back(static_cast<float>(height_m(column, row)));
  }
  return {size, {0, 0}, {cell_m, -cell_m}, std::move(heights_m)};
}

double sum_m(const HeightGrid& grid) {
  return std::accumulate(grid.heights_m().begin(), grid.heights_m().end(), 0.0);
}

constexpr std::array<glm::ivec2, 8> around{
    {{1, 0}, {0, 1}, {1, 1}, {1, -1}, {-1, 0}, {0, -1}, {-1, -1}, {-1, 1}}};

bool is_inside(const HeightGrid& grid, glm::ivec2 at) {
  return at.x >= 0 && at.y >= 0 && at.x < grid.columns() && at.y < grid.rows();
}

double steepest_slope(const HeightGrid& grid) {
  double steepest = 0;
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      for (const glm::ivec2 move : around) {
        const glm::ivec2 to = glm::ivec2(column, row) + move;
        if (!is_inside(grid, to)) continue;
        const double rise_m = static_cast<double>(grid.height_m(to.x, to.y)) -
                              static_cast<double>(grid.height_m(column, row));
        const double slope =
            std::abs(rise_m) / glm::length(glm::dvec2(move) * glm::abs(grid.step_m()));
        if (slope > steepest) steepest = slope;  // not for NaN
      }
    }
  }
  return steepest;
}

TEST(Talus, SlopesEndAtTheAngleOfReposeAndMassIsConserved) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> height_m(0, 12);
  const HeightGrid rough = grid_of({70, 50}, 0.5, [&](int, int) { return height_m(random); });
  const HeightGrid result = eroded(rough, {.streams = {}, .talus_rad = repose_rad}, plenty);
  EXPECT_GT(steepest_slope(rough), 10);
  EXPECT_LE(steepest_slope(result), std::tan(repose_rad));
  // Each height is rounded to float, by at most 2^-25 of 16 m.
  EXPECT_NEAR(sum_m(result), sum_m(rough), 3500 * 16 * 0x1p-25);
}

// Float heights of 3000 m are multiples of 0.24 mm.
TEST(Talus, RoundingOfHighGroundDoesNotExceedTheAngle) {
  for (const double angle_deg : {33.0, 35.0, 40.0}) {
    const double angle_rad = angle_deg * std::numbers::pi / 180;
    const HeightGrid cliff =
        grid_of({60, 40}, 1, [](int column, int row) { return 3000 - column - 0.3 * row; });
    const HeightGrid result = eroded(cliff, {.streams = {}, .talus_rad = angle_rad}, plenty);
    EXPECT_LE(steepest_slope(result), std::tan(angle_rad)) << angle_deg;
  }
}

TEST(Talus, RefusesHeightsThatAreTooCoarse) {
  const HeightGrid high = grid_of({30, 30}, 1, [](int column, int) { return 1e7 + 50 * column; });
  EXPECT_THAT([&] { eroded(high, {.streams = {}, .talus_rad = repose_rad}, plenty); },
              ThrowsMessage<Error>(HasSubstr("are too coarse, as floats, for slopes")));
}

// Half of the material above the middle of a cliff comes to lie below it.
TEST(Talus, ACliffBecomesARampOfTheAngleOfRepose) {
  constexpr double high_m = 20, cell_m = 0.5;
  const HeightGrid cliff =
      grid_of({201, 5}, cell_m, [](int column, int) { return column < 100 ? high_m : 0.0; });
  const HeightGrid result = eroded(cliff, {.streams = {}, .talus_rad = repose_rad}, plenty);
  for (int column = 0; column < 201; ++column) {
    const double x_m = (column - 99.5) * cell_m;
    const double ramp_m = std::clamp(high_m / 2 - x_m * std::tan(repose_rad), 0.0, high_m);
    // Slopes settle from 0.1 % to 0.02 % below the angle, over 20 m of height; a cell is 0.35 m
    // high.
    EXPECT_NEAR(result.height_m(column, 2), ramp_m, 0.1) << column;
  }
}

TEST(Talus, GentleGroundAndHolesStayAsTheyAre) {
  HeightGrid gentle = grid_of({20, 20}, 1, [](int column, int row) {
    return column == 7 && row == 9 ? std::nan("") : 0.5 * column + 100;
  });
  const HeightGrid result = eroded(gentle, {.streams = {}, .talus_rad = repose_rad}, plenty);
  for (std::size_t i = 0; i < gentle.heights_m().size(); ++i) {
    const float before = gentle.heights_m()[i], after = result.heights_m()[i];
    EXPECT_TRUE(before == after || (std::isnan(before) && std::isnan(after))) << i;
  }
}

// A channel of length L to whose sides `width_m` drains. With n = 1, heights migrate upstream at
// the speed K A^m, so that h(x, t) = h0(x') where the wave takes the time t from x' to x.
double channel_error_m(int count) {
  constexpr double length_m = 1000, width_m = 50, head_m2 = 2000, erodibility = 1e-3, years = 3e3;
  const double step_m = length_m / count;
  const auto height_m = [](double x_m) { return 40 * x_m * x_m / (length_m * length_m); };
  FlowTree tree;
  std::vector<double> areas_m2, heights_m;
  for (int i = 0; i <= count; ++i) {
    tree.order.push_back(static_cast<std::uint32_t>(i));
    tree.receivers.push_back(static_cast<std::uint32_t>(std::max(i - 1, 0)));
    tree.distances_m.push_back(step_m);
    areas_m2.push_back(width_m * (length_m - i * step_m) + head_m2);
    heights_m.push_back(height_m(i * step_m));
  }
  const StreamPower law{.years = years, .erodibility = erodibility};
  for (int step = 0; step < count; ++step) incise(tree, areas_m2, law, years / count, heights_m);
  double worst_m = 0;
  for (int i = 0; i <= count; ++i) {
    // Time from the outlet to x: 2 (sqrt A(0) - sqrt A(x)) / (K width).
    const double root = std::sqrt(areas_m2[static_cast<std::size_t>(i)]) +
                        years * erodibility * width_m / 2;  // sqrt A(x')
    const double from_m = std::max(0.0, length_m - (root * root - head_m2) / width_m);
    worst_m =
        std::max(worst_m, std::abs(heights_m[static_cast<std::size_t>(i)] - height_m(from_m)));
  }
  return worst_m;
}

TEST(StreamPower, WavesMigrateUpAChannelAsTheClosedFormSays) {
  const double coarse_m = channel_error_m(500), fine_m = channel_error_m(2000);
  EXPECT_LT(fine_m, 0.1);
  EXPECT_NEAR(coarse_m / fine_m, 4, 1);  // of first order
}

// Drainage of a grid without depressions, found by walking down from every sample.
struct Walked {
  double slope = 0, area_m2 = 0;
};
std::vector<Walked> walk(const HeightGrid& grid) {
  const double cell_m2 = std::abs(grid.step_m().x * grid.step_m().y);
  std::vector<Walked> found(grid.heights_m().size());
  const auto index = [&](glm::ivec2 at) {
    return static_cast<std::size_t>(at.y) * static_cast<std::size_t>(grid.columns()) +
           static_cast<std::size_t>(at.x);
  };
  for (int start = 0; start < static_cast<int>(found.size()); ++start) {
    glm::ivec2 at(start % grid.columns(), start / grid.columns());
    while (true) {
      found[index(at)].area_m2 += cell_m2;
      if (at.x == 0 || at.y == 0 || at.x == grid.columns() - 1 || at.y == grid.rows() - 1) break;
      double steepest = 0;
      glm::ivec2 next = at;
      for (const glm::ivec2 move : around) {
        const glm::ivec2 to = at + move;
        const double fall_m = static_cast<double>(grid.height_m(at.x, at.y)) -
                              static_cast<double>(grid.height_m(to.x, to.y));
        const double slope = fall_m / glm::length(glm::dvec2(move) * glm::abs(grid.step_m()));
        if (slope > steepest) {
          steepest = slope;
          next = to;
        }
      }
      found[index(at)].slope = steepest;
      if (next == at) return {};  // a depression
      at = next;
    }
  }
  return found;
}

class SteadyState : public ::testing::TestWithParam<double> {};

// Where uplift equals incision, U = K A^m S^n at every sample.
TEST_P(SteadyState, SlopeFollowsAreaAsTheClosedFormSays) {
  const StreamPower law{.years = 5e7,
                        .erodibility = 2e-5,
                        .area_exponent = 0.45,
                        .slope_exponent = GetParam(),
                        .uplift_m_yr = 1e-4,
                        .steps = 600};
  std::mt19937 random(2);
  std::uniform_real_distribution<double> height_m(0, 1);
  const HeightGrid flat = grid_of({41, 36}, 100, [&](int, int) { return height_m(random); });
  const HeightGrid result = eroded(flat, {.streams = law, .talus_rad = {}}, plenty);
  const std::vector<Walked> drainage = walk(result);
  ASSERT_FALSE(drainage.empty());
  int compared = 0;
  for (const auto& [slope, area_m2] : drainage) {
    if (slope == 0) continue;  // outlets
    const double expected = std::pow(law.uplift_m_yr / law.erodibility, 1 / law.slope_exponent) *
                            std::pow(area_m2, -law.area_exponent / law.slope_exponent);
    EXPECT_NEAR(slope / expected, 1, 1e-3) << area_m2;
    ++compared;
  }
  EXPECT_EQ(compared, 39 * 34);
}
INSTANTIATE_TEST_SUITE_P(Exponents, SteadyState, ::testing::Values(0.7, 1.0, 1.6));

// A bowl's bed lies under water, so that no stream incises it.
TEST(StreamPower, BedsOfLakesStayAsTheyAre) {
  const auto bowl = [](int column, int row) {
    return 10 - 9 * std::exp(-(std::pow(column - 15, 2) + std::pow(row - 15, 2)) / 40);
  };
  const HeightGrid before = grid_of({31, 31}, 10, bowl);
  const HeightGrid after = eroded(
      before, {.streams = StreamPower{.years = 100, .erodibility = 1e-4}, .talus_rad = {}}, plenty);
  EXPECT_EQ(after.height_m(15, 15), before.height_m(15, 15));
  EXPECT_EQ(after.height_m(18, 15), before.height_m(18, 15));
}

TEST(Erosion, TerrainIsTheErodedDem) {
  const testing::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "dem.tif";
  const HeightGrid cliff =
      grid_of({40, 30}, 1, [](int column, int row) { return column < 20 ? 30.0 + row : 0.0; });
  testing::save_geotiff(cliff, file);
  const ErosionSpec spec{.streams = StreamPower{.years = 1e3, .erodibility = 1e-4},
                         .talus_rad = repose_rad};
  const Terrain terrain(file, {}, {}, {}, {}, spec);
  const HeightGrid expected = eroded(load_dem(file).grid, spec, plenty);
  EXPECT_TRUE(std::ranges::equal(terrain.whole()->heights_m(), expected.heights_m()));
  EXPECT_LE(steepest_slope(*terrain.whole()), std::tan(repose_rad));
  EXPECT_NE(terrain.fingerprint(), Terrain(file, {}, {}).fingerprint());
}

TEST(Erosion, RefusesWhatExceedsTheMemory) {
  const HeightGrid flat = grid_of({100, 100}, 1, [](int, int) { return 0; });
  EXPECT_THAT([&] { eroded(flat, {.streams = {}, .talus_rad = repose_rad}, 1000); },
              ThrowsMessage<Error>(HasSubstr("erosion of a DEM of 100 x 100 samples takes 1 MiB")));
  const testing::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "dem.tif";
  testing::save_geotiff(grid_of({300, 200}, 1, [](int, int) { return 0; }), file);
  EXPECT_THAT(
      [&] {
        Terrain(file, {}, {.memory_mib = 1}, {}, {},
                ErosionSpec{.streams = {}, .talus_rad = repose_rad});
      },
      ThrowsMessage<Error>(HasSubstr(
          "erosion needs all of the DEM in memory, but its 300 x 200 samples exceed memory_mib")));
}

TEST(Erosion, ListsValuesOutOfBounds) {
  const HeightGrid flat = grid_of({3, 3}, 1, [](int, int) { return 0; });
  const StreamPower law{.years = 0,
                        .erodibility = -1,
                        .area_exponent = 3,
                        .slope_exponent = 9,
                        .uplift_m_yr = 0.5,
                        .steps = 0};
  EXPECT_THAT(
      [&] { eroded(flat, {.streams = law, .talus_rad = 2}, plenty); },
      ThrowsMessage<Error>(::testing::AllOf(
          HasSubstr("years = 0"), HasSubstr("erodibility = -1"), HasSubstr("area_exponent = 3"),
          HasSubstr("slope_exponent = 9"), HasSubstr("uplift_m_yr = 0.5 must be from 0 to 0.1"),
          HasSubstr("steps = 0"), HasSubstr("talus_rad = 2"))));
}

}  // namespace
}  // namespace groundray::erosion_test
