#include "reconstruction/mesh/scan/scan_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>

#include "core/error.h"
#include "test/support/scans/beam_fan.h"
#include "test/support/scans/linked_scan.h"

namespace groundray::scan_mesh_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)
using Random = std::mt19937_64;

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST(ScanMesh, ClosesRoundScans) {
  const RangeOf cylinder = [](const glm::dvec3& towards) {
    return 6 / std::hypot(towards.x, towards.y);
  };
  const BeamFan fan{.rings = 5, .columns = 90, .columns_per_turn = 90};
  const ScreeningLimits any = limits(85);
  ScanReturns fired = seen(fan, cylinder);
  EXPECT_EQ(link(organise(fired).scan, any).mesh.shape.triangles.size(), 4u * 90 * 2);
  fired.columns.clear();
  EXPECT_EQ(link(organise(fired).scan, any).mesh.shape.triangles.size(), 4u * 90 * 2);
  // Without columns 30 and 31: faces link the seam of azimuth, but not the gap.
  const ScanReturns gap = kept(fired, [](std::size_t i) { return i % 90 != 30 && i % 90 != 31; });
  const OrganisedScan open = organise(gap).scan;
  const ScanMesh made = link(open, any);
  expect_sound(made, open);
  EXPECT_EQ(all_faces(made), 4u * 87 * 2);
  EXPECT_EQ(made.mesh.shape.triangles.size(), 4u * 87 * 2);
}

TEST(ScanMesh, EachCellIsASurfaceOrAnOcclusion) {
  Random random(2);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int trial = 0; trial < 100; ++trial) {
    const int rings = 2 + trial % 5, columns = 3 + trial % 11;
    const bool is_round = trial % 3 == 0;
    const BeamFan fan{
        .rings = rings, .columns = columns, .columns_per_turn = is_round ? columns : 360.};
    OrganisedScan scan = scan_of(fan, [&](const glm::dvec3&) { return 1 + 10 * uniform(random); });
    scan.is_round = is_round;
    for (glm::dvec3& p : scan.points_m) {
      if (uniform(random) < 0.3) p = glm::dvec3(nan);
    }
    std::size_t expected = 0;
    for (int row = 0; row + 1 < rings; ++row) {
      for (int column = 0; column + (is_round ? 0 : 1) < columns; ++column) {
        int there = 0;
        for (const auto& [r, c] : {std::pair(0, 0), {0, 1}, {1, 0}, {1, 1}}) {
          const int cell = (row + r) * columns + (column + c) % columns;
          there += std::isfinite(scan.points_m[static_cast<std::size_t>(cell)].x);
        }
        expected += static_cast<std::size_t>(std::max(0, there - 2));
      }
    }
    const ScanMesh made = link(scan, limits(60 + uniform(random) * 29));
    expect_sound(made, scan);
    EXPECT_EQ(all_faces(made), expected);
  }
}

// The same surface, in whichever direction rows and columns run.
TEST(ScanMesh, OrderOfRowsAndColumnsDoesNotMatter) {
  Random random(3);
  std::normal_distribution<double> normal;
  const BeamFan fan{.rings = 12, .columns = 120, .columns_per_turn = 120};
  const ScanReturns fired = seen(fan, [&](const glm::dvec3& towards) {
    return 6 + std::sin(7 * towards.x) + 0.1 * normal(random);
  });
  const auto surface = [](const OrganisedScan& scan) {
    const ScanMesh made = link(scan, limits(75));
    expect_sound(made, scan);
    std::map<std::array<std::uint32_t, 3>, float> faces;
    for (std::size_t f = 0; f < made.mesh.shape.triangles.size(); ++f) {
      const glm::uvec3& t = made.mesh.shape.triangles[f];
      std::array<std::uint32_t, 3> face{scan.returns[made.cells[t.x]],
                                        scan.returns[made.cells[t.y]],
                                        scan.returns[made.cells[t.z]]};
      std::ranges::rotate(face, std::ranges::min_element(face));
      faces[face] = made.face_confidence[f];
    }
    return faces;
  };
  const auto expected = surface(organise(fired).scan);
  EXPECT_GT(expected.size(), 1000u);
  ScanReturns permuted = fired, mirrored = fired;
  for (std::int32_t& ring : permuted.rings) ring = (ring * 5 + 3) % 12;
  for (std::int32_t& column : mirrored.columns) column = 119 - column;
  for (std::int32_t& ring : mirrored.rings) ring = 11 - ring;
  for (const OrganisedScan& scan :
       {organise(permuted).scan, organise(mirrored).scan,
        organise(mirrored, ReturnChoice::Last, RowOrder::Number).scan}) {
    const auto found = surface(scan);
    ASSERT_EQ(found.size(), expected.size());
    for (const auto& [face, confidence] : expected) {
      ASSERT_TRUE(found.contains(face));
      EXPECT_NEAR(found.at(face), confidence, 1e-6);
    }
  }
}

// The confidence of a wall seen squarely by parallel beams is known: 1 well inside, 1/4 at the
// border.
TEST(ScanMesh, ConfidenceFallsTowardsTheBorder) {
  OrganisedScan scan{.rows = 12, .columns = 12};
  for (int row = 0; row < 12; ++row) {
    for (int column = 0; column < 12; ++column) {
      scan.origins_m.emplace_back(0.01 * column, 0.01 * row, 1);
      scan.points_m.emplace_back(0.01 * column, 0.01 * row, 0);
      scan.sd_m.push_back(0);
    }
  }
  const ScanMesh made = link(scan, ScreeningLimits::object());
  ASSERT_EQ(made.cells.size(), 144u);
  for (std::size_t i = 0; i < 144; ++i) {
    const int row = static_cast<int>(i) / 12, column = static_cast<int>(i) % 12;
    const int depth = std::min({row, column, 11 - row, 11 - column, 3});
    EXPECT_NEAR(made.mesh.confidence[i], (1 + depth) / 4., 1e-6) << i;
  }
}

// On a plane seen at an angle each face has the cosine; faces of stretched cells have less.
TEST(ScanMesh, ConfidenceIsTheCosineOfIncidenceAndLessForStretchedCells) {
  for (const double stretch : {1., 3., 10.}) {
    for (const double incidence_deg : {0., 30., 60.}) {
      const double slope = std::tan(incidence_deg * degree);
      OrganisedScan scan{.rows = 20, .columns = 20};
      for (int row = 0; row < 20; ++row) {
        for (int column = 0; column < 20; ++column) {
          const double x = 0.01 * column, y = 0.01 * stretch * row;
          scan.origins_m.emplace_back(x, y, 5);
          scan.points_m.emplace_back(x, y, slope * y);
          scan.sd_m.push_back(0);
        }
      }
      const ScanMesh made = link(scan, limits(89));
      const double high_m = 0.01 * stretch / std::cos(incidence_deg * degree);
      const double longest_m2 = high_m * high_m + 1e-4;
      const double expected =
          std::cos(incidence_deg * degree) * std::min(1.0, 2 * 0.01 * high_m / longest_m2);
      const auto amid = static_cast<std::size_t>(std::ranges::find(made.cells, 10u * 20 + 10) -
                                                 made.cells.begin());
      EXPECT_NEAR(made.mesh.confidence[amid], expected, 1e-6);
      EXPECT_NEAR(std::ranges::max(made.face_confidence), expected, 1e-6);
    }
  }
}

TEST(ScanMesh, VerticesHaveTheAttributesOfTheirReturns) {
  OrganisedScan scan = scan_of({.rings = 4, .columns = 30}, plane_at({1, 0, 0}, 5));
  for (std::size_t i = 0; i < scan.points_m.size(); ++i) {
    scan.sd_m[i] = 0.001f * static_cast<float>(i);
    scan.labels.push_back(static_cast<std::uint16_t>(i % 13));
  }
  const ScanMesh made = link(scan, ScreeningLimits::ground());
  ASSERT_FALSE(made.cells.empty());
  for (std::size_t i = 0; i < made.cells.size(); ++i) {
    EXPECT_EQ(made.mesh.sd_m[i], scan.sd_m[made.cells[i]]);
    EXPECT_EQ(made.mesh.labels[i], scan.labels[made.cells[i]]);
  }
}

TEST(ScanMesh, GridsWithoutNeighboursMakeNoFaces) {
  const ScreeningLimits any = ScreeningLimits::ground();
  EXPECT_EQ(all_faces(link({}, any)), 0u);
  for (const auto& [rings, columns] : {std::pair(1, 50), {50, 1}, {1, 1}, {2, 2}}) {
    OrganisedScan scan = scan_of({.rings = rings, .columns = columns}, plane_at({1, 0, 0}, 5));
    for (const bool is_round : {false, true}) {
      scan.is_round = is_round;
      const ScanMesh made = link(scan, any);
      expect_sound(made, scan);
      EXPECT_EQ(all_faces(made), rings == 2 ? 2u : 0u);
    }
  }
  for (const auto& [rows, columns] : {std::pair(5, 0), {0, 5}}) {
    const OrganisedScan nothing{.rows = rows, .columns = columns, .is_round = true};
    EXPECT_EQ(all_faces(link(nothing, any)), 0u);
  }
  const OrganisedScan sky = organise(ScanReturns{.p_S = {glm::dvec3(nan)}}).scan;
  EXPECT_EQ(all_faces(link(sky, any)), 0u);
}

// Beams that cross, points that coincide, points at their beams' origins, and points at extreme
// distances.
TEST(ScanMesh, DegenerateInputMakesNoDegenerateFaces) {
  Random random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 200; ++trial) {
    OrganisedScan scan{.rows = 5, .columns = 6, .is_round = trial % 2 == 0};
    for (std::size_t i = 0; i < 30; ++i) {
      const double scale = std::pow(10., static_cast<double>(trial % 5) * 3 - 3);
      const auto any = [&] {
        return scale * glm::dvec3(uniform(random), uniform(random), uniform(random));
      };
      scan.points_m.push_back(uniform(random) < -0.7 ? glm::dvec3(1) : any());
      scan.origins_m.push_back(uniform(random) < -0.9   ? scan.points_m.back()
                               : uniform(random) < -0.3 ? glm::dvec3(0)
                                                        : any());
      scan.sd_m.push_back(trial % 3 == 0 ? 0.f : static_cast<float>(std::abs(uniform(random))));
    }
    const ScanMesh made = link(scan, limits(85, infinite, 3));
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const glm::uvec3& t : made.mesh.shape.triangles) {
      EXPECT_TRUE(edges.emplace(t.x, t.y).second);
      EXPECT_TRUE(edges.emplace(t.y, t.z).second);
      EXPECT_TRUE(edges.emplace(t.z, t.x).second);
    }
    for (const float c : made.face_confidence) EXPECT_TRUE(0 <= c && c <= 1) << c;
    for (const float c : made.mesh.confidence) EXPECT_TRUE(0 <= c && c <= 1) << c;
  }
}

TEST(ScanMesh, ReportsAllFaultsAtOnce) {
  const OrganisedScan scan = scan_of({.rings = 3, .columns = 3}, plane_at({1, 0, 0}, 5));
  const auto message = [](const OrganisedScan& from, const ScreeningLimits& by) -> std::string {
    try {
      link(from, by);
    } catch (const Error& fault) {
      return fault.what();
    }
    return "";
  };
  EXPECT_THAT(message(scan, {.incidence_rad = 88, .longest_m = 0, .noise_sds = -1}),
              AllOf(HasSubstr("incidence_rad = 88 must be > 0 and <= pi / 2: is it in degrees?"),
                    HasSubstr("longest_m = 0 must be > 0"), HasSubstr("noise_sds = -1")));
  EXPECT_THAT(message(scan, {.incidence_rad = nan, .longest_m = nan, .noise_sds = nan}),
              AllOf(HasSubstr("incidence_rad"), HasSubstr("longest_m"), HasSubstr("noise_sds")));
  OrganisedScan bad = scan;
  bad.points_m.pop_back();
  bad.sd_m[0] = -1;
  bad.labels.resize(2);
  EXPECT_THAT(message(bad, ScreeningLimits::ground()),
              AllOf(HasSubstr("points_m has 8 values for 9 cells"), HasSubstr("sd_m of cell 0"),
                    HasSubstr("labels has 2 values")));
  bad = scan;
  bad.points_m[4] = {1e16, 0, 0};
  EXPECT_THAT(message(bad, ScreeningLimits::ground()), HasSubstr("the point of cell 4"));
  EXPECT_EQ(message(scan, {.incidence_rad = std::numbers::pi / 2, .longest_m = infinite}), "");
}

}  // namespace
}  // namespace groundray::scan_mesh_test
