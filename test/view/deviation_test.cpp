#include "apps/view/compare/deviation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>
#include <stop_token>

#include "apps/scene/interruption.h"
#include "core/error.h"
#include "core/geometry/height_grid.h"
#include "test/support/margin.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::deviation_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// A unit sphere about the origin, divided into `bands` bands of latitude and twice as many columns.
TriangleMesh sphere(std::uint32_t bands) {
  TriangleMesh mesh;
  const std::uint32_t columns = 2 * bands;
  for (std::uint32_t i = 0; i <= bands; ++i) {
    for (std::uint32_t k = 0; k < columns; ++k) {
      const double polar = std::numbers::pi * i / bands, azimuth = std::numbers::pi * k / bands;
      mesh.vertices_m.emplace_back(std::sin(polar) * std::cos(azimuth),
                                   std::sin(polar) * std::sin(azimuth), std::cos(polar));
    }
  }
  for (std::uint32_t i = 0; i < bands; ++i) {
    for (std::uint32_t k = 0; k < columns; ++k) {
      const std::uint32_t a = i * columns + k, b = i * columns + (k + 1) % columns;
      if (i + 1 < bands) mesh.triangles.emplace_back(a, a + columns, b + columns);
      if (i > 0) mesh.triangles.emplace_back(a, b + columns, b);
    }
  }
  // Each pole becomes a single vertex, shared like the others.
  for (glm::uvec3& triangle : mesh.triangles) {
    for (glm::length_t k = 0; k < 3; ++k) {
      if (triangle[k] < columns) triangle[k] = 0;
      if (triangle[k] >= bands * columns) triangle[k] = bands * columns;
    }
  }
  return mesh;
}

// A triangle soup: each triangle has its own vertices, as in an STL file.
TriangleMesh soup_of(const TriangleMesh& mesh) {
  TriangleMesh soup;
  for (const glm::uvec3& triangle : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.vertices_m.size());
    for (glm::length_t k = 0; k < 3; ++k) soup.vertices_m.push_back(mesh.vertices_m[triangle[k]]);
    soup.triangles.emplace_back(first, first + 1, first + 2);
  }
  return soup;
}

// Winding number of a closed mesh about a point: 1 inside, 0 outside. Van Oosterom and Strackee,
// The solid angle of a plane triangle (1983).
double winding(const TriangleMesh& mesh, const glm::dvec3& p) {
  double sum = 0;
  for (const glm::uvec3& triangle : mesh.triangles) {
    const glm::dvec3 a = mesh.vertices_m[triangle.x] - p, b = mesh.vertices_m[triangle.y] - p,
                     c = mesh.vertices_m[triangle.z] - p;
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    sum += 2 * std::atan2(
                   glm::dot(a, glm::cross(b, c)),
                   la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
  }
  return sum / (4 * std::numbers::pi);
}

std::vector<glm::dvec3> random_places(std::size_t count, double size_m) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(-size_m, size_m);
  std::vector<glm::dvec3> places_m(count);
  for (glm::dvec3& p : places_m) p = {uniform(random), uniform(random), uniform(random)};
  return places_m;
}

// The mesh lies inside the sphere, by its sagitta at most.
TEST(DeviationFromTruth, OfConcentricSpheresIsTheDifferenceOfRadii) {
  constexpr std::uint32_t bands = 60;
  const TrueMesh truth(sphere(bands));
  const double side_rad = std::numbers::pi / bands;
  const double sagitta_m = 1 - std::cos(side_rad / 2) * std::cos(side_rad / 2);
  double farthest_m = 0;
  const auto places_m = random_places(20'000, 1.5);
  const Deviation deviation = deviation_from_mesh(places_m, truth);
  for (std::size_t i = 0; i < places_m.size(); ++i) {
    const double off_m = deviation.signed_m[i] - (glm::length(places_m[i]) - 1);
    EXPECT_GT(off_m, -1e-6);  // single precision
    EXPECT_LT(off_m, sagitta_m + 1e-6);
    farthest_m = std::max(farthest_m, off_m);
  }
  groundray::testing::record_margin("deviation from a sphere of triangles, in sagittas",
                                    farthest_m / sagitta_m, 1);
  EXPECT_EQ(deviation.figures.count, places_m.size());
  EXPECT_EQ(deviation.figures.beyond, 0U);
}

TEST(DeviationFromTruth, IsTheSameForATriangleSoup) {
  const TriangleMesh mesh = sphere(12);
  const auto places_m = random_places(2'000, 1.5);
  const Deviation whole = deviation_from_mesh(places_m, TrueMesh(mesh));
  const Deviation soup = deviation_from_mesh(places_m, TrueMesh(soup_of(mesh)));
  EXPECT_EQ(whole.signed_m, soup.signed_m);
  EXPECT_EQ(whole.figures.beyond, 0U);
}

// Counts of the sides that were computed for points in and round a star.
struct StarSides {
  int inside = 0, wrong = 0;
  int wrong_by_face = 0;  // with the normal of the nearest triangle alone
};

// Queries points in and round a star with sharp spikes and deep folds.
StarSides look_at_star(std::uint64_t seed, std::size_t places) {
  TriangleMesh star = sphere(8);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0.2, 2);
  for (glm::dvec3& p : star.vertices_m) p *= uniform(random);
  const TrueMesh truth(star);
  StarSides sides;
  std::uint32_t near = 0;
  for (const glm::dvec3& p : random_places(places, 2)) {
    const double signed_m = truth.signed_distance_m(p, near);
    if (std::abs(signed_m) < 1e-9) continue;
    const bool is_inside = winding(star, p) > 0.5;
    sides.inside += is_inside ? 1 : 0;
    sides.wrong += (signed_m < 0) == is_inside ? 0 : 1;
    const glm::uvec3& t = star.triangles[near];
    const glm::dvec3& a = star.vertices_m[t.x];
    const glm::dvec3 normal = glm::cross(star.vertices_m[t.y] - a, star.vertices_m[t.z] - a);
    sides.wrong_by_face += (glm::dot(p - a, normal) < 0) == is_inside ? 0 : 1;
  }
  return sides;
}

TEST(DeviationFromTruth, DistinguishesInsideAndOutsideOfAStar) {
  const StarSides sides = look_at_star(3, 5'000);
  EXPECT_EQ(sides.wrong, 0);
  EXPECT_GT(sides.inside, 200);
  EXPECT_GT(sides.wrong_by_face, 10);  // the star is a difficult case
}

TEST(DeviationFromTruthProof, DistinguishesInsideAndOutsideOfManyStars) {
  const std::size_t stars = groundray::testing::proof_size(4, 200);
  for (std::uint64_t seed = 10; seed < 10 + stars; ++seed)
    EXPECT_EQ(look_at_star(seed, 4'000).wrong, 0) << "star " << seed;
}

TEST(DeviationFromTruth, IsNaNBeyondTheBoundary) {
  const TrueMesh plate({.vertices_m = {{0, 0, 1}, {2, 0, 1}, {2, 2, 1}, {0, 2, 1}},
                        .triangles = {{0, 1, 2}, {0, 2, 3}},
                        .levels = {}});
  std::uint32_t near = 0;
  EXPECT_DOUBLE_EQ(plate.signed_distance_m({1, 1, 3}, near), 2);
  EXPECT_DOUBLE_EQ(plate.signed_distance_m({1, 1, 0.5}, near), -0.5);
  EXPECT_DOUBLE_EQ(plate.signed_distance_m({0, 0, 1.25}, near), 0.25);
  EXPECT_NEAR(plate.signed_distance_m({-0.1, 1, 1.5}, near), std::hypot(0.1, 0.5), 1e-15);
  EXPECT_NEAR(plate.signed_distance_m({2.1, 2.1, 0.5}, near), -std::sqrt(0.27), 1e-15);
  EXPECT_TRUE(std::isnan(plate.signed_distance_m({-0.5, 1, 1.4}, near)));
  EXPECT_TRUE(std::isnan(plate.signed_distance_m({3, 3, 1}, near)));
  EXPECT_TRUE(std::isnan(plate.signed_distance_m({nan, 0, 0}, near)));
}

// The plane z = x / 2 - y / 4 + 3: a distance perpendicular to it is the vertical distance times
// the normal's z.
TEST(DeviationFromTruth, MatchesTheClosedFormForATiltedPlane) {
  const auto height_m = [](double x, double y) { return x / 2 - y / 4 + 3; };
  std::vector<float> heights_m;
  for (int row = 0; row < 9; ++row) {
    for (int column = 0; column < 9; ++column)
      heights_m.push_back(static_cast<float>(height_m(column, 8 - row)));
  }
  const HeightGrid grid({9, 9}, {0, 8}, {1, -1}, heights_m);
  const TrueMesh mesh({.vertices_m = {{0, 0, height_m(0, 0)},
                                      {8, 0, height_m(8, 0)},
                                      {8, 8, height_m(8, 8)},
                                      {0, 8, height_m(0, 8)}},
                       .triangles = {{0, 1, 2}, {0, 2, 3}},
                       .levels = {}});
  const double normal_z = 1 / std::sqrt(1 + 0.25 + 0.0625);
  std::vector<glm::dvec3> places_m;
  std::vector<double> above_m;
  for (const glm::dvec3& random : random_places(1'000, 1)) {
    const glm::dvec2 at = 4.0 + 2.0 * glm::dvec2(random);
    above_m.push_back(random.z / 2);
    places_m.emplace_back(at, height_m(at.x, at.y) + above_m.back());
  }
  const Deviation up = deviation_from_ground(places_m, grid);
  const Deviation across = deviation_from_mesh(places_m, mesh);
  double sum_m = 0, sum2_m2 = 0, worst_m = 0;
  for (std::size_t i = 0; i < places_m.size(); ++i) {
    EXPECT_NEAR(up.signed_m[i], above_m[i], 1e-7);
    EXPECT_NEAR(across.signed_m[i], above_m[i] * normal_z, 1e-7);
    worst_m = std::max(worst_m, std::abs(across.signed_m[i] - above_m[i] * normal_z));
    sum_m += above_m[i];
    sum2_m2 += above_m[i] * above_m[i];
  }
  groundray::testing::record_margin("deviation from a plane", worst_m, 1e-7, "m");
  EXPECT_NEAR(up.figures.mean_m, sum_m / 1000, 1e-8);
  EXPECT_NEAR(up.figures.rms_m, std::sqrt(sum2_m2 / 1000), 1e-8);
  EXPECT_NEAR(across.figures.rms_m, normal_z * up.figures.rms_m, 1e-7);
}

TEST(DeviationFromTruth, OfADemFromItselfIsZeroExceptInHoles) {
  std::vector<float> heights_m(30, 2);
  heights_m[7] = static_cast<float>(nan);
  const HeightGrid grid({6, 5}, {10, 20}, {2, -2}, heights_m);
  std::vector<glm::dvec3> places_m;  // of all samples, row by row
  for (int i = 0; i < 30; ++i)
    places_m.emplace_back(grid.frame().to_D({i % 6, i / 6}), grid.height_m(i % 6, i / 6));
  EXPECT_EQ(places_m[8], glm::dvec3(14, 18, 2));
  const Deviation deviation = deviation_from_ground(places_m, grid);
  EXPECT_TRUE(std::isnan(deviation.signed_m[7]));
  EXPECT_EQ(deviation.signed_m[29], 0);
  EXPECT_EQ(deviation.figures.largest_m, 0);
  EXPECT_GE(deviation.figures.beyond, 1U);
}

// Computed by hand: the median of -1, 0, 1, 2, 10 is 1, and the distances to it are 2, 1, 0, 1, 9.
TEST(DeviationFromTruth, StatisticsMatchTheirDefinitions) {
  const auto nothing = static_cast<float>(nan);
  const DeviationFigures figures = figures_of({10, nothing, -1, 1, 0, 2, nothing});
  EXPECT_EQ(figures.count, 5U);
  EXPECT_EQ(figures.beyond, 2U);
  EXPECT_DOUBLE_EQ(figures.mean_m, 12 / 5.0);
  EXPECT_DOUBLE_EQ(figures.rms_m, std::sqrt(106 / 5.0));
  EXPECT_DOUBLE_EQ(figures.median_m, 1);
  EXPECT_DOUBLE_EQ(figures.nmad_m, 1.4826);
  EXPECT_DOUBLE_EQ(figures.p95_m, 10);  // four of five are 2 or less, which is below 95 %
  EXPECT_DOUBLE_EQ(figures.largest_m, 10);
  EXPECT_DOUBLE_EQ(figures.low_m, -1);
  EXPECT_DOUBLE_EQ(figures.high_m, 10);
  EXPECT_THAT(figure_lines(figures), ::testing::Contains("2 points beyond the truth"));
  const DeviationFigures none = figures_of({nothing});
  EXPECT_EQ(none.count, 0U);
  EXPECT_TRUE(std::isnan(none.mean_m));
  EXPECT_TRUE(std::isnan(none.p95_m));
  EXPECT_THAT(figure_lines(none)[1], HasSubstr("none"));
}

TEST(DeviationFromTruth, HistogramCountsEachBin) {
  const std::vector<float> values{-2, -1, -0.5F, 0, 0.5F, 1, 3, static_cast<float>(nan)};
  const DeviationHistogram histogram = histogram_of(values, 4, std::pair(-1.0, 1.0));
  EXPECT_THAT(histogram.counts, ElementsAre(1, 1, 1, 2));
  EXPECT_EQ(histogram.below, 1U);
  EXPECT_EQ(histogram.above, 1U);
  const DeviationHistogram all = histogram_of(values, 10);
  EXPECT_LE(all.low_m, 0);
  EXPECT_GE(all.high_m, 0);
  std::size_t counted = all.below + all.above;
  for (const std::size_t count : all.counts) counted += count;
  EXPECT_EQ(counted, 7U);
  EXPECT_EQ(histogram_of({}, 3).counts.size(), 3U);
  EXPECT_THROW(histogram_of(values, 0), Error);
  EXPECT_THROW(histogram_of(values, 3, std::pair(1.0, -1.0)), Error);
}

TEST(DeviationFromTruth, IsTheSameForAnyNumberOfThreads) {
  const TrueMesh truth(sphere(20));
  const auto places_m = random_places(100'000, 2);
  const Deviation many = deviation_from_mesh(places_m, truth);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(deviation_from_mesh(places_m, truth).signed_m, many.signed_m);
}

TEST(DeviationFromTruth, ReportsProgressAndStops) {
  const TrueMesh truth(sphere(6));
  const auto places_m = random_places(150'000, 2);
  std::vector<double> shares;
  deviation_from_mesh(places_m, truth, {}, [&](double share) { shares.push_back(share); });
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_EQ(shares.size(), 4U);
  EXPECT_EQ(shares.back(), 1);
  std::stop_source stop;
  std::size_t reported = 0;
  EXPECT_THROW(deviation_from_mesh(places_m, truth, stop.get_token(),
                                   [&](double) {
                                     if (++reported == 2) stop.request_stop();
                                   }),
               Interrupted);
  EXPECT_EQ(reported, 2U);
}

TEST(DeviationFromTruth, RejectsOrToleratesBadMeshes) {
  EXPECT_THROW(TrueMesh(TriangleMesh{}), Error);
  EXPECT_THROW(
      TrueMesh({.vertices_m = {{0, 0, nan}, {1, 0, 0}, {0, 1, 0}}, .triangles = {{0, 1, 2}}}),
      Error);
  // One edge with three triangles on the same side, one of them without area, and one face twice,
  // back to back.
  const TrueMesh wild({.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.5, 0, 0}},
                       .triangles = {{0, 1, 2}, {0, 2, 1}, {1, 0, 3}, {0, 1, 4}},
                       .levels = {}});
  const auto places_m = random_places(1'000, 2);
  const Deviation deviation = deviation_from_mesh(places_m, wild);
  EXPECT_EQ(deviation.figures.count + deviation.figures.beyond, places_m.size());
  EXPECT_EQ(deviation_from_mesh({}, wild).figures.count, 0U);
}

TEST(DeviationFromTruth, ReportsPrecisionAndCompleteness) {
  const TriangleMesh plate{.vertices_m = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},
                           .triangles = {{0, 1, 2}, {0, 2, 3}},
                           .levels = {}};
  const std::vector<double> tolerances_m{0.01};
  EXPECT_THAT(agreement_lines(agreement(plate, plate, tolerances_m)),
              ElementsAre("within 0.01 m: precision 100.00 %, completeness 100.00 %, F1 100.00 %"));
}

// Two rectangles that are 5 cm apart and overlap in half of each.
TEST(AgreementUntil, MatchesAgreementUnlessStopped) {
  const TriangleMesh truth{
      {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, {}};
  TriangleMesh mesh = truth;
  for (glm::dvec3& p : mesh.vertices_m) p += glm::dvec3(1, 0, 0.05);
  const std::vector<double> tolerances_m = {0.06};
  std::stop_source stop;
  const auto all = agreement_until(mesh, truth, tolerances_m, stop.get_token());
  const auto expected = agreement(mesh, truth, tolerances_m);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].precision.value, expected[0].precision.value);
  EXPECT_EQ(all[0].completeness.value, expected[0].completeness.value);
  // The tolerance extends sqrt(0.06^2 - 0.05^2) m beyond the edge.
  EXPECT_NEAR(all[0].precision.value, (1 + std::sqrt(0.0011)) / 2, 0.02);
  stop.request_stop();
  EXPECT_THROW(agreement_until(mesh, truth, tolerances_m, stop.get_token()), Interrupted);
}

}  // namespace
}  // namespace groundray::deviation_test
