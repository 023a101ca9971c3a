#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "core/geometry/pose.h"
#include "reconstruction/mesh/scan/beam_columns.h"
#include "reconstruction/mesh/scan/scan_mesh.h"
#include "test/support/margin.h"
#include "test/support/scans/beam_fan.h"
#include "test/support/scans/organised_cells.h"

namespace groundray::sensor_motion_test {
namespace {

using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

constexpr double sweep_s = 0.1;

// Motion of a sensor: along x of its first pose, turning at a constant rate.
struct Drive {
  double speed_m_per_s = 0, turn_rad_per_s = 0;
  double stamp_s = 0;  // after the first firing

  Pose at(double t_s) const {
    const double yaw_rad = turn_rad_per_s * t_s, way_m = speed_m_per_s * t_s;
    const double radius_m = turn_rad_per_s == 0 ? 0 : speed_m_per_s / turn_rad_per_s;
    const glm::dvec3 p = turn_rad_per_s == 0
                             ? glm::dvec3(way_m, 0, 0)
                             : radius_m * glm::dvec3(std::sin(yaw_rad), 1 - std::cos(yaw_rad), 0);
    return {rotation_from_yaw_pitch_roll(yaw_rad, 0, 0), p};
  }
};

struct Seen {
  ScanReturns as_fired, at_stamp;  // with rings, columns and times
};

// Rings are offset by up to 12 columns, as in many lidars.
BeamFan staggered() {
  BeamFan fan{.rings = 32,
              .lowest_rad = -25 * degree,
              .highest_rad = 5 * degree,
              .columns = 1024,
              .columns_per_turn = 1024};
  for (int ring = 0; ring < fan.rings; ++ring)
    fan.aside_columns.push_back(
        std::array{-12., -4.1, 3.9, 11.8}[static_cast<std::size_t>(ring % 4)]);
  return fan;
}

// A yard with flat ground 1.8 m below, walls, and noise of 1 cm.
Seen drive(const BeamFan& fan, const Drive& drive) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0, 0.01);
  const std::vector<glm::dvec4> walls{
      {1, 0.1, 0, 12}, {-1, 0, 0, 18}, {0, 1, 0, 7}, {0.1, -1, 0, 5}, {0, 0, -1, 1.8}};
  Seen seen;
  for (int ring = 0; ring < fan.rings; ++ring) {
    for (int column = 0; column < fan.columns; ++column) {
      const double t_s = sweep_s * column / fan.columns_per_turn;
      const Pose X_WS = drive.at(t_s);
      const glm::dvec3 towards_S = fan.towards(ring, column), towards = X_WS.rotation * towards_S;
      double range_m = std::numeric_limits<double>::infinity();
      for (const glm::dvec4& wall : walls) {
        const double along = glm::dot(glm::dvec3(wall), towards);
        const double away_m = wall.w - glm::dot(glm::dvec3(wall), X_WS.translation_m);
        if (along > 0) range_m = std::min(range_m, away_m / along);
      }
      const glm::dvec3 p_S = (range_m + normal(random)) * towards_S;
      seen.as_fired.p_S.push_back(p_S);
      seen.at_stamp.p_S.push_back(inverse(drive.at(drive.stamp_s)) * (X_WS * p_S));
      for (ScanReturns* returns : {&seen.as_fired, &seen.at_stamp}) {
        returns->rings.push_back(ring);
        returns->columns.push_back(column);
        returns->times_s.push_back(t_s);
      }
    }
  }
  return seen;
}

// Number of columns between the azimuths, as fired, of returns in one cell column and adjacent
// rows: the 99th percentile.
double columns_apart(const OrganisedScan& scan, const BeamFan& fan, const ScanReturns& fired) {
  std::vector<double> apart;
  const auto columns = static_cast<std::size_t>(scan.columns);
  const auto place = [&](std::uint32_t i) {
    return fired.columns[i] + fan.aside_columns[static_cast<std::size_t>(fired.rings[i])];
  };
  for (std::size_t cell = 0; cell + columns < scan.returns.size(); ++cell) {
    const std::uint32_t a = scan.returns[cell], b = scan.returns[cell + columns];
    if (a == OrganisedScan::none || b == OrganisedScan::none) continue;
    apart.push_back(std::abs(std::remainder(place(a) - place(b), fan.columns_per_turn)));
  }
  std::ranges::sort(apart);
  return apart[apart.size() * 99 / 100];
}

const std::vector<Drive> drives{{2, 0.3, 0},  {2, -0.6, 0},    {2, 0, sweep_s / 2},
                                {10, 0.2, 0}, {10, -0.2, 0.1}, {20, 0, sweep_s / 2}};

// De-skewing to one stamp hides the rings' azimuth offsets by parallax. Nearly all faces of the
// points as fired must remain, and cells of a column must hold points seen side by side: rows are
// shifted by whole columns, so these are at most one column apart, plus the effect of yaw on a turn
// of the head.
TEST(SensorMotion, DeskewedPointsKeepTheirColumns) {
  const BeamFan fan = staggered();
  for (const Drive& way : drives) {
    SCOPED_TRACE(::testing::Message() << way.speed_m_per_s << " m/s, " << way.turn_rad_per_s);
    const Seen seen = drive(fan, way);
    const std::size_t before =
        link(organise(seen.as_fired).scan, ScreeningLimits::ground()).mesh.shape.triangles.size();
    ScanReturns timed = without_columns(seen.at_stamp), numbered = seen.at_stamp;
    numbered.times_s.clear();
    for (const ScanReturns& table : {timed, numbered}) {
      const auto made = organise(table);
      EXPECT_EQ(made.counts.crowded + made.counts.other_returns, 0u);
      EXPECT_LE(columns_apart(made.scan, fan, seen.as_fired), 1.05);
      const std::size_t faces =
          link(made.scan, ScreeningLimits::ground()).mesh.shape.triangles.size();
      EXPECT_GE(static_cast<double>(faces), 0.97 * static_cast<double>(before));
      record_margin("faces lost by points at one stamp",
                    1 - static_cast<double>(faces) / static_cast<double>(before), 0.03);
    }
  }
}

// A point that is known at one stamp is observed from the sensor's position when it fired: azimuths
// are those of the beams, except for a constant rate and a constant offset.
TEST(SensorMotion, RecoversTheAzimuthsOfTheBeams) {
  const BeamFan fan = staggered();
  for (const Drive& way : drives) {
    const Seen seen = drive(fan, way);
    std::vector<double> azimuths_rad, distances_m, clock;
    for (std::size_t i = 0; i < seen.at_stamp.p_S.size(); ++i) {
      const glm::dvec3& p = seen.at_stamp.p_S[i];
      azimuths_rad.push_back(std::atan2(p.y, p.x));
      distances_m.push_back(std::hypot(p.x, p.y));
      clock.push_back(1e3 * seen.at_stamp.times_s[i]);
    }
    const BeamRows rows{{seen.at_stamp.rings.begin(), seen.at_stamp.rings.end()}, fan.rings};
    const auto found = azimuths_as_fired(clock, rows, {azimuths_rad, distances_m});
    ASSERT_TRUE(found);
    std::vector<double> off_columns;
    const double column_rad = 2 * std::numbers::pi / fan.columns_per_turn;
    for (std::size_t i = 0; i < found->size(); ++i) {
      const glm::dvec3& p = seen.as_fired.p_S[i];
      const double turned_rad = way.turn_rad_per_s * (seen.at_stamp.times_s[i] - way.stamp_s);
      off_columns.push_back(
          std::remainder((*found)[i] - std::atan2(p.y, p.x) - turned_rad, 2 * std::numbers::pi) /
          column_rad);
    }
    const auto [low, high] = std::ranges::minmax(off_columns);
    // A part of the error is the curvature of the sensor's path: half the turn times half the
    // distance, divided by the range.
    const double bent_m = std::abs(way.turn_rad_per_s * way.speed_m_per_s) * sweep_s * sweep_s / 8;
    EXPECT_LE(high - low, 0.15 + 2 * bent_m / 2.5 / column_rad) << way.speed_m_per_s;
  }
}

// Without motion azimuths stay unchanged, and so do azimuths that no motion explains.
TEST(SensorMotion, AzimuthsWithoutMotionStayUnchanged) {
  const BeamFan fan = staggered();
  Seen seen = drive(fan, {});
  const auto find = [&] {
    std::vector<double> azimuths_rad, distances_m;
    for (const glm::dvec3& p : seen.at_stamp.p_S) {
      azimuths_rad.push_back(std::atan2(p.y, p.x));
      distances_m.push_back(std::hypot(p.x, p.y));
    }
    const BeamRows rows{{seen.at_stamp.rings.begin(), seen.at_stamp.rings.end()}, fan.rings};
    return azimuths_as_fired(seen.at_stamp.times_s, rows, {azimuths_rad, distances_m});
  };
  EXPECT_FALSE(find()) << "it stands";
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal(0, 0.03);
  for (glm::dvec3& p : seen.at_stamp.p_S) p += glm::dvec3(normal(random), normal(random), 0);
  EXPECT_FALSE(find()) << "its points tremble";
  std::shuffle(seen.at_stamp.p_S.begin(), seen.at_stamp.p_S.end(), random);
  EXPECT_FALSE(find()) << "its points are in no order";
  seen.at_stamp = {};
  EXPECT_FALSE(find()) << "there are none";
}

}  // namespace
}  // namespace groundray::sensor_motion_test
