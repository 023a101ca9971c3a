#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/geometry/pose.h"
#include "reconstruction/mesh/scan/organised_scan.h"
#include "test/support/scans/beam_fan.h"
#include "test/support/scans/organised_cells.h"

namespace groundray::beam_rows_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)
using Random = std::mt19937_64;

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST(BeamRows, OrdersRingsByElevation) {
  const ScanReturns fired = seen({}, room);
  ScanReturns permuted = without_columns(fired);
  for (std::int32_t& ring : permuted.rings) ring = 1000 - 37 * ((ring * 7) % 16);  // with gaps
  const auto made = organise(permuted), plain = organise(without_columns(fired));
  EXPECT_EQ(made.scan.returns, plain.scan.returns);
  EXPECT_EQ(made.scan.points_m, plain.scan.points_m);
}

TEST(BeamRows, SeparatesBeamsByElevation) {
  const BeamFan fan{.rings = 64, .lowest_rad = -25 * degree, .highest_rad = 3 * degree};
  ScanReturns fired = seen(fan, room);
  for (glm::dvec3& p : fired.p_S) p = glm::vec3(p);  // as in files
  ScanReturns bare = without_columns(fired);
  const auto with_rings = organise(bare);
  bare.rings.clear();
  const auto without_rings = organise(bare);
  EXPECT_EQ(without_rings.scan.rows, 64);
  EXPECT_EQ(without_rings.scan.returns, with_rings.scan.returns);
}

// As in KITTI's files: one ring after the other, from the highest down, with neither rings nor
// times; lenses are beside and above S's origin, so a beam's elevation depends on the range, and a
// third of the returns are missing.
TEST(BeamRows, SeparatesBeamsByTheOrderOfTheTable) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> noise(0, 0.02);
  for (const double seam : {0., 0.7, std::numbers::pi}) {
    for (const auto& [direction, aside] : {std::pair(1, 0.), {1, 44.3}, {-1, 44.3}}) {
      BeamFan fan{.rings = 64,
                  .lowest_rad = 2 * degree,
                  .highest_rad = -24.9 * degree,
                  .columns = 2000,
                  .columns_per_turn = 2000,
                  .first_azimuth_rad = seam + 1e-4,
                  .direction = direction};
      for (int ring = 0; ring < 64; ++ring)  // up to 8 degrees, as for the HDL-64E
        fan.aside_columns.push_back(aside * std::sin(5 * ring) + 0.3 * (ring % 3));
      ScanReturns fired = seen(fan, [&](const glm::dvec3& towards) {
        const double r = std::min(room(towards), -1.73 / std::min(towards.z, -1e-3));
        return uniform(random) < 0.33 ? infinite : r + noise(random);
      });
      for (glm::dvec3& p : fired.p_S) {
        p += 0.026 * glm::normalize(glm::dvec3(-p.y, p.x, 0)) + glm::dvec3(0, 0, 0.01);
        p = glm::vec3(p);
      }
      ScanReturns bare;
      bare.p_S = fired.p_S;
      const auto made = organise(bare);
      EXPECT_EQ(made.scan.rows, 64);
      EXPECT_EQ(made.scan.columns, 2000);
      EXPECT_TRUE(made.scan.is_round);
      const auto cells = cells_of(made.scan, fired.p_S.size());
      std::size_t placed = 0, there = 0;
      for (std::size_t i = 0; i < cells.size(); ++i) {
        if (!std::isfinite(fired.p_S[i].x)) continue;
        ++there;
        placed += cells[i].y == 63 - fired.rings[i];
      }
      EXPECT_GE(static_cast<double>(placed), 0.99 * static_cast<double>(there));
    }
  }
}

// The same from a moving car, with all points at the stamp, when the head looked ahead, as in
// KITTI's odometry data. Sweeps begin behind, tables ahead; a ring's elevations change with
// azimuth.
TEST(BeamRows, SeparatesBeamsOfMovingScansByTheOrderOfTheTable) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> uniform(0, 1);
  const BeamFan fan{.rings = 64,
                    .lowest_rad = 2 * degree,
                    .highest_rad = -24.9 * degree,
                    .columns = 2000,
                    .columns_per_turn = 2000,
                    .first_azimuth_rad = 1e-4};
  for (const auto& [way_m, turn_rad] : {std::pair(0.2, 0.), {1., 0.02}, {2., -0.02}}) {
    ScanReturns bare;
    std::vector<std::int32_t> rings;
    for (int ring = 0; ring < fan.rings; ++ring) {
      for (int column = 0; column < fan.columns; ++column) {
        const double share = (column < 1000 ? column : column - 2000) / 2000.;  // of the sweep
        const Pose X_WS{rotation_from_yaw_pitch_roll(turn_rad * share, 0, 0),
                        {way_m * share, 0, 0}};
        const glm::dvec3 towards = X_WS.rotation * fan.towards(ring, column);
        const double range_m = std::min(2 * room(towards), -1.73 / std::min(towards.z, -1e-3));
        if (uniform(random) < 0.2) continue;
        bare.p_S.emplace_back(glm::vec3(X_WS.translation_m + range_m * towards));
        rings.push_back(ring);
      }
    }
    const auto made = organise(bare);
    EXPECT_EQ(made.scan.rows, 64);
    const auto cells = cells_of(made.scan, bare.p_S.size());
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < cells.size(); ++i)
      wrong += cells[i].y >= 0 && cells[i].y != 63 - rings[i];
    EXPECT_LE(wrong, bare.p_S.size() / 500);
    EXPECT_LE(made.counts.crowded, bare.p_S.size() / 50);
  }
}

TEST(BeamRows, RejectsCloudsWithoutBeams) {
  Random random(3);
  std::normal_distribution<double> normal;
  ScanReturns cloud;
  for (int i = 0; i < 5000; ++i)
    cloud.p_S.emplace_back(normal(random), normal(random), normal(random));
  try {
    organise(cloud);
    FAIL();
  } catch (const Error& fault) {
    EXPECT_THAT(fault.what(), AllOf(HasSubstr("their 5000 elevations do not cluster"),
                                    HasSubstr("link them as points without order")));
  }
  // Rings alone are not sufficient for a rosette.
  for (int i = 0; i < 5000; ++i) cloud.rings.push_back(i % 6);
  try {
    organise(cloud);
    FAIL();
  } catch (const Error& fault) {
    EXPECT_THAT(fault.what(), AllOf(HasSubstr("not equally spaced"),
                                    HasSubstr("link them as points without order")));
  }
}

// Elevations in hundredths of a degree that drift with azimuth form clusters, but not those of
// beams.
TEST(BeamRows, RoundedElevationsAreNoBeams) {
  Random random(7);
  ScanReturns cloud;
  for (int beam = 0; beam < 32; ++beam) {
    for (int column = 0; column < 300; ++column) {
      if (std::uniform_real_distribution<double>(0, 1)(random) < 0.5) continue;
      const double a = 0.2 * column * degree;
      const double e =
          std::round(100 * (0.31 * beam + 0.4 * std::sin(3 * a + beam))) / 100 * degree;
      cloud.p_S.push_back(
          10. * glm::dvec3(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)));
    }
  }
  try {
    organise(cloud);
    FAIL();
  } catch (const Error& fault) {
    EXPECT_THAT(fault.what(), HasSubstr("give the rings, or link them as points without order"));
  }
}

TEST(BeamRows, APlanarScannerHasOneRow) {
  ScanReturns fired = seen({.rings = 1, .lowest_rad = 0, .columns = 270}, room);
  fired.rings.clear();
  const auto made = organise(without_columns(fired));
  EXPECT_EQ(made.scan.rows, 1);
  EXPECT_EQ(made.scan.columns, 270);
  EXPECT_FALSE(made.scan.is_round);
}

// An image of 12 x 20 points, as from a depth camera, whose lines run downwards.
TEST(BeamRows, ImageRowsKeepTheirOrder) {
  ScanReturns image;
  for (int row = 0; row < 12; ++row) {
    for (int column = 0; column < 20; ++column) {
      const bool is_there = row != 5 && row != 11 && column != 0;
      image.p_S.push_back(is_there ? glm::dvec3(4, 0.1 * (10 - column), 0.1 * (6 - row))
                                   : glm::dvec3(nan));
      image.rings.push_back(row);
      image.columns.push_back(column);
    }
  }
  const auto made = organise(image, ReturnChoice::Last, RowOrder::Number);
  EXPECT_EQ(made.scan.rows, 12);
  EXPECT_EQ(made.scan.columns, 20);
  EXPECT_FALSE(made.scan.is_round);
  for (std::size_t i = 0; i < image.p_S.size(); ++i) {
    if (std::isfinite(image.p_S[i].x)) {
      EXPECT_EQ(made.scan.returns[i], i);
    } else {
      EXPECT_EQ(made.scan.returns[i], OrganisedScan::none);
    }
  }
}

// Lines of an empty image have no columns, which is no error.
TEST(BeamRows, AcceptsImageRowsWithoutReturns) {
  const ScanReturns dark{.p_S = std::vector<glm::dvec3>(6, glm::dvec3(0)),
                         .rings = {0, 1, 2, 0, 1, 2}};
  const auto made = organise(dark, ReturnChoice::Last, RowOrder::Number);
  EXPECT_EQ(made.scan.rows, 3);
  EXPECT_EQ(made.scan.columns, 0);
}

}  // namespace
}  // namespace groundray::beam_rows_test
