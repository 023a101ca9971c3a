#include "sensors/lidar/pattern/risley_pattern.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <random>

#include "core/error.h"
#include "sensors/lidar/pattern/scan_pattern.h"

namespace groundray::risley_pattern_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using Tilted = WedgePrism::Tilted;

constexpr double pi = std::numbers::pi;
constexpr double epsilon = std::numeric_limits<double>::epsilon();

WedgePrism prism(double wedge_rad, double rate_hz, Tilted tilted = Tilted::Exit) {
  return {.wedge_rad = wedge_rad, .refractive_index = 1.51, .rate_hz = rate_hz, .tilted = tilted};
}

RisleyPattern pattern_of(std::vector<WedgePrism> prisms) {
  RisleyPattern pattern;
  pattern.prisms = std::move(prisms);
  pattern.beams = {Beam{}};
  pattern.firing_period_s = 1e-4;
  return pattern;
}

PulseBatch first_sweep(const RisleyPattern& pattern) {
  const ScanPattern scan(pattern);
  PulseBatch batch;
  scan.fill(0, 0, scan.pulses(0), batch);
  return batch;
}

// Snell's law directly: the ratio of the sines, and all three directions in one plane.
TEST(RisleyPattern, RefractionObeysSnellsLaw) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  const auto unit = [&] {
    return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
  };
  for (int i = 0; i < 10'000; ++i) {
    const glm::dvec3 face = unit();
    glm::dvec3 light = unit();
    if (glm::dot(light, face) < 0) light = -light;
    const double ratio = 1 / 1.51;
    const glm::dvec3 after = refracted(light, face, ratio);
    // sin i = n sin r as vectors perpendicular to the plane of incidence.
    const glm::dvec3 difference = glm::cross(light, face) * ratio - glm::cross(after, face);
    ASSERT_LE(glm::length(difference), 8 * epsilon);
    ASSERT_NEAR(glm::length(after), 1, 2 * epsilon);
    ASSERT_GT(glm::dot(after, face), 0);
  }
}

// A tilted exit face is hit from inside at the wedge angle a: sin(a + deviation) = n sin a. A
// tilted entry face refracts to r, sin a = n sin r, and the light leaves at sin(deviation) = n
// sin(a - r).
TEST(RisleyPattern, OneWedgeTracesACircleOfTheExactDeviation) {
  const double wedge_rad = 0.3;
  const double exit_rad = std::asin(1.51 * std::sin(wedge_rad)) - wedge_rad;
  const double inside_rad = std::asin(std::sin(wedge_rad) / 1.51);
  const double entry_rad = std::asin(1.51 * std::sin(wedge_rad - inside_rad));
  for (const auto& [tilted, deviation_rad] :
       {std::pair(Tilted::Exit, exit_rad), std::pair(Tilted::Entry, entry_rad)}) {
    const PulseBatch batch = first_sweep(pattern_of({prism(wedge_rad, 37, tilted)}));
    ASSERT_EQ(batch.size(), 1000u);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const glm::dvec3& d = batch.direction[i];
      EXPECT_NEAR(std::atan2(std::hypot(d.y, d.z), d.x), deviation_rad, 32 * epsilon);
      const double base_rad =
          2 * pi * 37 * batch.volleys[i].time_s;  // light bends towards the base
      EXPECT_NEAR(std::remainder(std::atan2(d.z, d.y) - base_rad, 2 * pi), 0, 1e-13);
    }
  }
}

// deviation = (n - 1) a + n (n^2 - 1) a^3 / 6 + ...: the next order is at most a^5 for n = 1.51.
TEST(RisleyPattern, ThinWedgeDeviatesByIndexMinusOneTimesItsAngle) {
  for (const double a : {1e-3, 1e-2, 5e-2}) {
    const glm::dvec3 d = first_sweep(pattern_of({prism(a, 11)})).direction[5];
    const double radius = std::atan2(std::hypot(d.y, d.z), d.x);
    const double third_order = 1.51 * (1.51 * 1.51 - 1) / 6 * a * a * a;
    EXPECT_NEAR(radius, 0.51 * a, 1.01 * third_order);
    EXPECT_NEAR(radius, 0.51 * a + third_order, a * a * a * a * a + 8 * epsilon);
  }
}

// A line by symmetry about the plane through the bisector of both bases, if the faces are symmetric
// too. With flat outer faces (the second's entry tilted, the first's exit tilted) the wedges mirror
// each other only to first order, so the line has a width of third order.
TEST(RisleyPattern, EqualCounterRotatingWedgesTraceALine) {
  for (const double a : {1e-3, 1e-2}) {
    const PulseBatch batch = first_sweep(pattern_of({prism(a, 20), prism(a, -20)}));
    double longest = 0;
    for (const glm::dvec3& d : batch.direction) {
      EXPECT_LE(std::abs(d.z), 2 * a * a * a);
      longest = std::max(longest, std::abs(d.y));
    }
    EXPECT_NEAR(longest, 2 * 0.51 * a, 4 * a * a * a + 1e-4 * a);  // sampled near its end
  }
}

// Equal, opposite bases form a plane-parallel plate, which only shifts light.
TEST(RisleyPattern, OppositeWedgesWithFacingTiltsDoNotDeviate) {
  RisleyPattern pattern = pattern_of({prism(0.4, 13), prism(0.4, 13, Tilted::Entry)});
  pattern.prisms[1].base_rad = pi;
  for (const glm::dvec3& d : first_sweep(pattern).direction) {
    EXPECT_LE(std::hypot(d.y, d.z), 16 * epsilon);
  }
}

TEST(RisleyPattern, HorizontalAxesAreLevelAndPerpendicularToTheBeam) {
  RisleyPattern pattern = pattern_of({prism(0.5, 131), prism(0.45, -47), prism(0.05, 213)});
  pattern.beams = {{.elevation_rad = 0.02, .ring = 3}, {.azimuth_offset_rad = -0.05, .ring = 4}};
  const PulseBatch batch = first_sweep(pattern);
  ASSERT_EQ(batch.size(), 2000u);
  EXPECT_EQ(batch.volleys.size(), 1000u);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    EXPECT_NEAR(glm::dot(batch.horizontal[i], batch.direction[i]), 0, 2 * epsilon);
    EXPECT_EQ(batch.horizontal[i].z, 0);
    EXPECT_GT(batch.horizontal[i].y, 0);
    EXPECT_EQ(batch.ring[i], 3 + i % 2);
  }
}

// Rates of 7 and -3 Hz first coincide again after one second.
TEST(RisleyPattern, RepeatsOnceAllPrismsAreBackAtTheirStart) {
  const ScanPattern scan(pattern_of({prism(0.3, 7), prism(0.2, -3)}));
  PulseBatch first;
  scan.fill(0, 0, 1000, first);
  for (std::int64_t sweep = 1; sweep <= 10; ++sweep) {
    PulseBatch batch;
    scan.fill(sweep, 0, 1000, batch);
    double farthest = 0;
    for (std::size_t i = 0; i < 1000; ++i) {
      farthest = std::max(farthest, glm::distance(batch.direction[i], first.direction[i]));
    }
    if (sweep == 10) {
      EXPECT_LE(farthest, 1e-13);
    } else {
      EXPECT_GE(farthest, 0.05) << sweep;
    }
  }
}

TEST(RisleyPattern, RejectsPrismsWithTotalInternalReflection) {
  EXPECT_THAT([] { ScanPattern{pattern_of({prism(0.73, 1)})}; },  // asin(1 / 1.51) = 0.724
              ThrowsMessage<Error>(HasSubstr("prisms[0]: total internal reflection")));
  EXPECT_NO_THROW(ScanPattern{pattern_of({prism(0.72, 1)})});
}

TEST(RisleyPattern, RejectsAPatternWithEveryFaultInOneError) {
  RisleyPattern pattern = pattern_of({prism(20, NAN)});
  pattern.prisms[0].refractive_index = 0.5;
  pattern.firing_period_s = 100;
  pattern.beams = {{.elevation_rad = 3}, {.loop = 1}};
  EXPECT_THAT([&] { ScanPattern{pattern}; },
              ThrowsMessage<Error>(AllOf(
                  HasSubstr("is the period in seconds?"), HasSubstr("beams[0]: its angles"),
                  HasSubstr("beams[1]: loop and origin_m must be 0"),
                  HasSubstr("prisms[0].refractive_index = 0.5"),
                  HasSubstr("prisms[0].wedge_rad = 20"), HasSubstr("prisms[0].rate_hz = nan"))));
}

}  // namespace
}  // namespace groundray::risley_pattern_test
