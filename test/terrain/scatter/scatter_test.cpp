#include "terrain/scatter/scatter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <vector>

#include "core/error.h"
#include "core/geometry/height_grid.h"
#include "test/support/terrain/sample_terrain.h"
#include "test/support/terrain/shuffled_runner.h"

namespace groundray::scatter_test {
namespace {

using std::numbers::pi;
using ::testing::AllOf;
using testing::fractal;
using ::testing::HasSubstr;
using testing::shuffled_runner;
using testing::threaded_runner;
using ::testing::ThrowsMessage;
using testing::with_holes;

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double infinity = std::numeric_limits<double>::infinity();

// Square centred on D's origin, z = slope.x x + slope.y y; rows run south.
HeightGrid plane(double side_m, glm::dvec2 slope = {0, 0}) {
  std::vector<float> heights_m;
  for (const int y : {1, -1}) {
    for (const int x : {-1, 1}) {
      heights_m.push_back(static_cast<float>((slope.x * x + slope.y * y) * side_m / 2));
    }
  }
  return {{2, 2}, {-side_m / 2, side_m / 2}, {side_m, -side_m}, heights_m};
}

// Eight by eight fields of 40 m with densities from 0 to the highest, in steps.
DensityMap steps(double highest_per_m2) {
  std::vector<float> per_m2;
  for (int i = 0; i < 64; ++i) {
    per_m2.push_back(static_cast<float>(highest_per_m2 * ((i * 37 + 11) % 64 % 9) / 8));
  }
  return {{8, 8}, {-160, 160}, {40, -40}, per_m2};
}

std::vector<Placement> only(const std::vector<Placement>& all, const auto& which) {
  std::vector<Placement> some;
  std::ranges::copy_if(all, std::back_inserter(some), which);
  return some;
}

glm::dvec2 place(const Placement& plant) { return glm::dvec2(plant.p_DO); }

ScatterSpec meadow() {
  return {.layer = 3,
          .min_distance_m = 1.5,
          .scale = {0.5, 2},
          .stance = Stance::OnSlope,
          .weights = {1, 2, 3},
          .origin_w_m = {500'003, 5'150'001}};
}

TEST(Scatter, PlacementsDoNotDependOnThreads) {
  const HeightGrid ground = with_holes(fractal(65, 5, 60, Seed{1}), 20, 3, Seed{2});
  const Scatter scatter(ground, steps(0.2), meadow(), Seed{7});
  const auto once = scatter.placements({}, threaded_runner(1));
  EXPECT_GT(once.size(), 5000U);
  EXPECT_EQ(scatter.placements({}, threaded_runner(2)), once);
  EXPECT_EQ(scatter.placements({}, threaded_runner(5)), once);
  EXPECT_EQ(scatter.placements({}, shuffled_runner(Seed{9})), once);
  EXPECT_EQ(scatter.placements(), once);
}

TEST(Scatter, PlacementsOfAnAreaAreASubsetOfAllPlacements) {
  const Scatter scatter(fractal(65, 5, 60, Seed{1}), steps(0.2), meadow(), Seed{7});
  const auto all = scatter.placements();
  std::size_t some = 0;
  for (std::uint32_t i = 0; i < 40; ++i) {
    const glm::dvec2 low = random_uniform({.seed = {3}, .pulse = i}) * 340.0 - 180.0;
    const glm::dvec2 size_m = random_uniform({.seed = {4}, .pulse = i}) * (i % 2 == 0 ? 100. : 5.);
    const Area area{low, low + size_m};
    const auto part = scatter.placements(area);
    EXPECT_EQ(part, only(all, [&](const Placement& p) { return area.contains(place(p)); }));
    some += part.size();
  }
  EXPECT_GT(some, 1000U);
}

// A DEM cut out of another has a different origin of D, so the plants' coordinates in D differ. Two
// coordinates in W are rounded, by 2^-30 m each.
TEST(Scatter, PlantsKeepTheirPositionInWWhenTheDemIsCropped) {
  ScatterSpec spec = meadow();
  const auto whole = Scatter(plane(300), DensityMap(0.2), spec, Seed{7}).placements();
  const glm::dvec2 moved(37, -53);
  spec.origin_w_m += moved;
  const auto part = Scatter(plane(100), DensityMap(0.2), spec, Seed{7}).placements();
  std::map<std::uint64_t, Placement> known;
  for (const Placement& plant : whole) known[plant.key] = plant;
  const Area cut{moved - 50., moved + 50.};
  EXPECT_EQ(part.size(),
            only(whole, [&](const Placement& p) { return cut.contains(place(p)); }).size());
  for (const Placement& plant : part) {
    ASSERT_TRUE(known.contains(plant.key));
    EXPECT_LE(glm::length(place(plant) + moved - place(known[plant.key])), 0x1p-28);
    EXPECT_EQ(plant.scale, known[plant.key].scale);
    EXPECT_EQ(plant.prototype, known[plant.key].prototype);
  }
}

// Compares all pairs in neighbouring boxes; distances in D round by less than 1e-12 m.
TEST(Scatter, PlantsKeepTheMinimumDistance) {
  for (const double coverage : {0.1, 0.45}) {
    const double r_m = 0.8;
    const double per_m2 = coverage / (pi / 4 * r_m * r_m);
    ScatterSpec spec = meadow();
    spec.min_distance_m = r_m;
    const auto all = Scatter(plane(120), DensityMap(per_m2), spec, Seed{1}).placements();
    std::map<std::pair<int, int>, std::vector<glm::dvec2>> boxes;
    double least_m = infinity;
    for (const Placement& plant : all) {
      const glm::ivec2 at(glm::floor(place(plant) / r_m));
      for (int i = 0; i < 9; ++i) {
        for (const glm::dvec2 other : boxes[{at.x + i % 3 - 1, at.y + i / 3 - 1}]) {
          least_m = std::min(least_m, glm::length(place(plant) - other));
        }
      }
      boxes[{at.x, at.y}].push_back(place(plant));
    }
    EXPECT_GE(least_m, r_m - 1e-12);
    EXPECT_LE(least_m, r_m * 1.001);  // and some are nearly as close
  }
}

TEST(Scatter, KeysAreSortedAndPositionsDifferBetweenLayersAndSeeds) {
  std::set<std::pair<double, double>> places;
  std::size_t count = 0;
  for (const std::uint32_t layer : {0U, 1U}) {
    for (const std::uint64_t seed : {1U, 2U}) {
      const auto all =
          Scatter(plane(100), DensityMap(0.3), {.layer = layer}, Seed{seed}).placements();
      EXPECT_TRUE(std::ranges::is_sorted(all, std::less_equal<>{}, &Placement::key));
      for (const Placement& p : all) places.emplace(p.p_DO.x, p.p_DO.y);
      count += all.size();
    }
  }
  EXPECT_EQ(places.size(), count);
}

// Fields of 40 m are 50 minimum distances wide. Counts of a hard-core process vary less than
// Poisson counts. The statistic is therefore below chi-square's 0.999 quantile with at least that
// probability, and the total is within 4 Poisson standard deviations except for a probability of at
// most 6e-5.
TEST(Scatter, CountsMatchTheDensityMap) {
  ScatterSpec spec{.min_distance_m = 0.8};
  const double highest = 0.42 / (pi / 4 * 0.64);
  const DensityMap map = steps(highest);
  std::vector<double> counts(64);
  for (const Placement& p : Scatter(plane(320), map, spec, Seed{3}).placements()) {
    const glm::ivec2 at((p.p_DO.x + 160) / 40, (160 - p.p_DO.y) / 40);
    ++counts[static_cast<std::size_t>(at.y) * 8 + static_cast<std::size_t>(at.x)];
  }
  double statistic = 0;
  double total = 0, expected_total = 0;
  int fields = 0;
  for (int i = 0; i < 64; ++i) {
    const double expected = 1600 * map.per_m2_at({-140 + 40 * (i % 8), 140 - 40 * (i / 8)});
    const double count = counts[static_cast<std::size_t>(i)];
    if (expected == 0) {
      EXPECT_EQ(count, 0);
      continue;
    }
    statistic += (count - expected) * (count - expected) / expected;
    total += count;
    expected_total += expected;
    ++fields;
  }
  EXPECT_GT(fields, 50);
  EXPECT_NEAR(total, expected_total, 4 * std::sqrt(expected_total));
  // The quantile by Wilson and Hilferty, accurate to 1e-3 here.
  const double spread = 2.0 / (9 * fields);
  EXPECT_LT(statistic, fields * std::pow(1 - spread + 3.0902 * std::sqrt(spread), 3));
  RecordProperty("statistic", std::to_string(statistic) + " of " + std::to_string(fields));
}

// Compares the mean of 24 seeds with density times area. The standard error is estimated from the
// same seeds, so the statistic has Student's distribution with 23 degrees of freedom: it exceeds
// 4.8 with a probability of 8e-5, 4e-4 over all five (Šidák). The documented error of 2e-4 is
// added.
TEST(Scatter, TotalIsTheIntegralOfTheDensity) {
  for (const double coverage : {0.0, 0.05, 0.2, 0.35, 0.45}) {
    const double per_m2 = 0.5;
    const double r_m = std::sqrt(coverage / (pi / 4 * per_m2));
    constexpr int seeds = 24;
    constexpr double side_m = 100;
    double sum = 0, squares = 0;
    for (std::uint64_t seed = 0; seed < seeds; ++seed) {
      const Scatter scatter(plane(side_m), DensityMap(per_m2), {.min_distance_m = r_m},
                            Seed{100 + seed});
      const auto count = static_cast<double>(scatter.placements().size());
      sum += count;
      squares += count * count;
    }
    const double mean = sum / seeds;
    const double error = std::sqrt((squares - sum * mean) / (seeds - 1) / seeds);
    const double expected = per_m2 * side_m * side_m;
    EXPECT_NEAR(mean, expected, 2e-4 * expected + 4.8 * error) << coverage;
    // The standard error must not hide a bias: hard-core counts vary less than Poisson counts.
    EXPECT_LT(error, 1.6 * std::sqrt(expected / seeds));
  }
}

// Limits and clearings remove plants and leave the others unchanged: neighbours do not fill the
// gaps.
TEST(Scatter, LimitsRemoveOnlyThePlantsThatViolateThem) {
  const HeightGrid ground = with_holes(fractal(65, 5, 120, Seed{4}), 20, 3, Seed{5});
  const auto all = Scatter(ground, DensityMap(0.2), meadow(), Seed{7}).placements();
  ScatterSpec spec = meadow();
  spec.slope_deg = {5, 25};
  spec.height_m = {-10, 30};
  spec.clearings = {{.points_D = {{-100, 0}, {100, 0}}, .half_width_m = 8}};
  const auto some = Scatter(ground, DensityMap(0.2), spec, Seed{7}).placements();
  // Slope from height differences 1 cm around the position. These lie on one facet, except within 2
  // cm of an edge; such positions are omitted.
  const auto slope_deg = [&](glm::dvec2 p) -> std::optional<double> {
    const auto h = [&](double x, double y) { return ground.height_m_at(p + glm::dvec2(x, y)); };
    const auto a = h(0.01, 0), b = h(-0.01, 0), c = h(0, 0.01), d = h(0, -0.01), e = h(0, 0);
    if (!a || !b || !c || !d || !e) return {};
    if (std::abs(*a + *b - 2 * *e) + std::abs(*c + *d - 2 * *e) > 1e-9) return {};
    return std::atan(std::hypot(*a - *b, *c - *d) / 0.02) * 180 / pi;
  };
  const auto is_kept = [&](const Placement& p) {
    const auto slope = slope_deg(place(p));
    const bool is_on_track =
        std::abs(p.p_DO.y) <= 8 && std::abs(p.p_DO.x) <= 100;  // its rounded ends are omitted
    return slope && spec.slope_deg.contains(*slope) && spec.height_m.contains(p.p_DO.z) &&
           !is_on_track;
  };
  const auto is_clear = [&](const Placement& p) {
    return slope_deg(place(p)) && std::abs(std::abs(p.p_DO.x) - 104) > 4 + 1e-9;
  };
  EXPECT_EQ(only(some, is_clear), only(only(all, is_clear), is_kept));
  EXPECT_GT(only(some, is_clear).size(), 1000U);
  for (const Placement& p : some) EXPECT_TRUE(spec.height_m.contains(p.p_DO.z));
}

TEST(Scatter, NoPlantsInHolesOrOutsideTheGround) {
  const HeightGrid ground = with_holes(fractal(33, 5, 60, Seed{1}), 12, 4, Seed{2});
  const auto all = Scatter(ground, DensityMap(0.5), {}, Seed{1}).placements();
  double cells = 0;  // in cells; each existing half counts 0.5
  for (int i = 0; i < 32 * 32; ++i) {
    const Cell cell = ground.cell(i % 32, i / 32);
    cells += (std::isnan(cell.plane(Half::Near).height_m) ? 0 : 0.5) +
             (std::isnan(cell.plane(Half::Far).height_m) ? 0 : 0.5);
  }
  EXPECT_LT(cells, 31 * 31);
  // Without a minimum distance the count is Poisson: 4 standard deviations, a probability of 6e-5.
  const double expected = cells * 25 * 0.5;
  EXPECT_NEAR(static_cast<double>(all.size()), expected, 4 * std::sqrt(expected));
  for (const Placement& p : all) EXPECT_EQ(p.p_DO.z, ground.height_m_at(place(p)));
}

// Returns the Kolmogorov statistic: the largest distance between the distribution of the values and
// the uniform one on [0, 1], in units of 1 / sqrt(n). It exceeds 1.95 with a probability of 1e-3.
double kolmogorov(std::vector<double> shares) {
  std::ranges::sort(shares);
  const auto n = static_cast<double>(shares.size());
  double most = 0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const auto k = static_cast<double>(i);
    most = std::max({most, shares[i] - k / n, (k + 1) / n - shares[i]});
  }
  return most * std::sqrt(n);
}

TEST(Scatter, YawAndScaleAreUniformAndPrototypesFollowTheirWeights) {
  ScatterSpec spec{
      .min_distance_m = 0.7, .scale = {0.5, 2}, .yaw_deg = {-30, 60}, .weights = {1, 0, 2, 5}};
  const auto all = Scatter(plane(150), DensityMap(0.9), spec, Seed{5}).placements();
  std::vector<double> yaws, scales;
  std::vector<double> counts(4);
  for (const Placement& p : all) {
    const glm::dvec3 ahead = p.R_DO * glm::dvec3(1, 0, 0);
    const double yaw_deg = std::atan2(ahead.y, ahead.x) * 180 / pi;
    EXPECT_TRUE(-30 - 1e-12 <= yaw_deg && yaw_deg <= 60 + 1e-12);
    EXPECT_TRUE(spec.scale.contains(p.scale));
    yaws.push_back((yaw_deg + 30) / 90);
    scales.push_back((p.scale - 0.5) / 1.5);
    ++counts.at(p.prototype);
  }
  EXPECT_LT(kolmogorov(yaws), 1.95);
  EXPECT_LT(kolmogorov(scales), 1.95);
  EXPECT_EQ(counts[1], 0);
  const auto n = static_cast<double>(all.size());
  double statistic = 0;
  for (const auto& [kind, weight] : {std::pair{0, 1.}, {2, 2.}, {3, 5.}}) {
    const double expected = n * weight / 8;
    const double off = counts[static_cast<std::size_t>(kind)] - expected;
    statistic += off * off / expected;
  }
  EXPECT_LT(statistic, 13.82);  // chi-square, 2 degrees of freedom: probability 1e-3
}

// Counts the pairs (yaw, scale) in a grid of 6 x 6: chi-square with 35 degrees of freedom exceeds
// 66.6 with a probability of 1e-3.
TEST(Scatter, YawAndScaleAreIndependent) {
  const ScatterSpec spec{.scale = {1, 2}};
  const auto all = Scatter(plane(150), DensityMap(1), spec, Seed{6}).placements();
  std::vector<double> counts(36);
  for (const Placement& p : all) {
    const glm::dvec3 ahead = p.R_DO * glm::dvec3(1, 0, 0);
    const double turn = std::atan2(ahead.y, ahead.x) / (2 * pi) + 0.5;
    ++counts.at(static_cast<std::size_t>(turn * 6) % 6 * 6 +
                static_cast<std::size_t>((p.scale - 1) * 6));
  }
  const double expected = static_cast<double>(all.size()) / 36;
  double statistic = 0;
  for (const double count : counts) statistic += (count - expected) * (count - expected) / expected;
  EXPECT_LT(statistic, 66.6);
}

TEST(Scatter, PlantsStandOnTheGroundUprightOrAlongItsNormal) {
  const glm::dvec2 slope(0.5, -0.25);  // heights are exact floats
  const glm::dvec3 normal = glm::normalize(glm::dvec3(-slope, 1));
  for (const Stance stance : {Stance::Upright, Stance::OnSlope}) {
    const ScatterSpec spec{.scale = {1, 3}, .stance = stance, .sink_m = 0.1};
    const auto all = Scatter(plane(64, slope), DensityMap(0.5), spec, Seed{8}).placements();
    EXPECT_GT(all.size(), 1500U);
    std::vector<double> turns;
    for (const Placement& p : all) {
      const glm::dvec3 up = p.R_DO * glm::dvec3(0, 0, 1);
      // A dozen roundings of numbers up to 1.
      EXPECT_LE(glm::length(up - (stance == Stance::Upright ? glm::dvec3(0, 0, 1) : normal)),
                12 * epsilon);
      EXPECT_NEAR(glm::length(p.R_DO), 1, 4 * epsilon);
      // A few roundings of heights up to 24 m.
      EXPECT_NEAR(p.p_DO.z, glm::dot(slope, place(p)) - 0.1 * p.scale, 24 * 4 * epsilon);
      // The heading in the plane, relative to D's x axis projected vertically onto the plane.
      const glm::dvec3 x = glm::normalize(glm::dvec3(1, 0, slope.x));
      const glm::dvec3 ahead = p.R_DO * glm::dvec3(1, 0, 0);
      if (stance == Stance::OnSlope) {
        const double turn = std::atan2(glm::dot(glm::cross(x, ahead), normal), glm::dot(x, ahead));
        turns.push_back(turn / (2 * pi) + 0.5);
      }
    }
    if (stance == Stance::OnSlope) {
      EXPECT_LT(kolmogorov(turns), 1.95);
    }
  }
}

TEST(Scatter, ASlightlyHigherDensityKeepsExistingPlants) {
  const ScatterSpec spec{.min_distance_m = 1};
  const auto few = Scatter(plane(60), DensityMap(0.40), spec, Seed{2}).placements();
  const auto many = Scatter(plane(60), DensityMap(0.41), spec, Seed{2}).placements();
  EXPECT_GT(many.size(), few.size());
  EXPECT_TRUE(std::ranges::includes(many, few, {}, &Placement::key, &Placement::key));
}

TEST(Scatter, ZeroDensityPlacesNoPlants) {
  EXPECT_TRUE(Scatter(plane(60), DensityMap(0), {}, Seed{2}).placements().empty());
  EXPECT_TRUE(
      Scatter(plane(60), DensityMap(1), {}, Seed{2}).placements({{100, 100}, {200, 200}}).empty());
}

TEST(Scatter, ErrorListsEveryFault) {
  EXPECT_THAT(
      [] {
        Scatter(plane(10), DensityMap(1),
                {.min_distance_m = -1,
                 .slope_deg = {30, 10},
                 .height_m = {5, -5},
                 .scale = {0, 1},
                 .yaw_deg = {0, infinity},
                 .sink_m = std::nan(""),
                 .weights = {0, 0},
                 .origin_w_m = {infinity, 0}},
                Seed{1});
      },
      ThrowsMessage<Error>(AllOf(
          HasSubstr("min_distance_m = -1"), HasSubstr("slope_deg = [30, 10] is empty"),
          HasSubstr("height_m = [5, -5] is empty"), HasSubstr("scale = [0, 1] must be positive"),
          HasSubstr("yaw_deg = [0, inf]"), HasSubstr("sink_m = nan"), HasSubstr("weights must"),
          HasSubstr("origin_w_m = (inf, 0)"))));
}

// The greatest density is 0.45 / (pi / 4 r^2).
TEST(Scatter, ErrorReportsTheGreatestDensityForTheDistance) {
  EXPECT_THAT([] { Scatter(plane(10), DensityMap(0.2), {.min_distance_m = 2}, Seed{1}); },
              ThrowsMessage<Error>(AllOf(HasSubstr("0.2 plants per m2"),
                                         HasSubstr("0.14324 per m2"), HasSubstr("1.6926 m"))));
}

TEST(Scatter, ErrorReportsAMapOutsideTheGround) {
  const DensityMap map({1, 1}, {500'000, 0}, {10, 10}, {1});
  EXPECT_THAT([&] { Scatter(plane(10), map, {}, Seed{1}); },
              ThrowsMessage<Error>(AllOf(HasSubstr("x 500000 to 500010"), HasSubstr("x -5 to 5"),
                                         HasSubstr("CRS"))));
}

TEST(Scatter, ErrorReportsTooManyPlants) {
  EXPECT_THAT([] { Scatter(plane(4000), DensityMap(2), {}, Seed{1}).placements(); },
              ThrowsMessage<Error>(AllOf(HasSubstr("3.2e+07 plants exceed the limit of 1000000"),
                                         HasSubstr("smaller area"))));
  EXPECT_THAT([] { Scatter(plane(40'000), DensityMap(2), {}, Seed{1}).placements(); },
              ThrowsMessage<Error>(HasSubstr("3.2e+09 candidate positions")));
  EXPECT_THAT(
      [] {
        Scatter(plane(10), DensityMap(1e5), {.origin_w_m = {5e5, 5e6}}, Seed{1}).placements();
      },
      ThrowsMessage<Error>(HasSubstr("indices overflow")));
}

// Neither condition moves a plant: those that remain are plants of the layer without conditions.
TEST(Scatter, SuitabilityThinsTheLayer) {
  ScatterSpec spec{.layer = 5};
  const Scatter all(plane(400), DensityMap(0.5), spec, Seed{2});
  spec.suitability = [](glm::dvec2 p) { return p.x < 0 ? 0.25 : p.y < 0 ? 0.0 : 1.0; };
  const Scatter some(plane(400), DensityMap(0.5), spec, Seed{2});
  const auto whole = all.placements(), thinned = some.placements();
  const auto is_on = [](bool west, bool south) {
    return [=](const Placement& plant) {
      return (place(plant).x < 0) == west && (place(plant).y < 0) == south;
    };
  };
  EXPECT_EQ(only(thinned, is_on(false, false)), only(whole, is_on(false, false)));
  EXPECT_TRUE(only(thinned, is_on(false, true)).empty());
  const double west = static_cast<double>(only(thinned, is_on(true, true)).size());
  EXPECT_NEAR(west, 0.125 * 200 * 200, 4 * std::sqrt(0.125 * 200 * 200));
  const std::set<std::uint64_t> keys = [&] {
    std::set<std::uint64_t> found;
    for (const Placement& plant : whole) found.insert(plant.key);
    return found;
  }();
  for (const Placement& plant : thinned) EXPECT_TRUE(keys.contains(plant.key));
}

// Kolmogorov-Smirnov statistic of the scales against the cut exponential distribution; 1.95 is the
// limit at a significance of 0.1 %.
TEST(Scatter, ScalesFollowTheirDistribution) {
  const ScatterSpec spec{.layer = 6, .scale = {1, 20}, .scales = Weibull{1, 7}};
  const auto plants = Scatter(plane(200), DensityMap(0.5), spec, Seed{4}).placements();
  std::vector<double> scales;
  for (const Placement& plant : plants) scales.push_back(plant.scale);
  std::ranges::sort(scales);
  ASSERT_GT(scales.size(), 15'000u);
  const auto count = static_cast<double>(scales.size());
  double farthest = 0;
  for (std::size_t i = 0; i < scales.size(); ++i) {
    const double share = (1 - std::exp(-(scales[i] - 1) / 7)) / (1 - std::exp(-19.0 / 7));
    farthest = std::max(farthest, std::abs(share - (static_cast<double>(i) + 0.5) / count));
  }
  EXPECT_LT(farthest * std::sqrt(count), 1.95);
}

}  // namespace
}  // namespace groundray::scatter_test
