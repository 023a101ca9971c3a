#include "terrain/traversability/traversability.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/random.h"

namespace groundray::traversability_test {
namespace {

constexpr double cell_m = 0.125;  // exact in binary
constexpr std::size_t memory_bytes = 1U << 30;
constexpr double degrees = 180 / std::numbers::pi;

// Values are floats, of heights that are floats: 2^-22 of 2 m.
constexpr double rounding_m = 1e-6;

constexpr VehicleSize vehicle{.length_m = 2,
                              .width_m = 1,
                              .wheelbase_m = 1.5,
                              .track_m = 1,
                              .clearance_m = 0.25,
                              .wheel_radius_m = 0.25};

HeightGrid ground_of(int side, const std::function<double(double x, double y)>& height_m) {
  std::vector<float> heights;
  const double half_m = (side - 1) * cell_m / 2;
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      heights.push_back(
          static_cast<float>(height_m(column * cell_m - half_m, half_m - row * cell_m)));
    }
  }
  return {{side, side}, {-half_m, half_m}, {cell_m, -cell_m}, heights};
}

TraversabilityLayers layers_of(const HeightGrid& ground, int headings = 8) {
  return traversability(ground, {.cell_m = cell_m, .vehicle = vehicle, .headings = headings},
                        memory_bytes);
}

// Index of the sample at a place.
std::size_t at(const TraversabilityLayers& layers, double x, double y) {
  const glm::dvec2 sample = layers.frame.to_grid({x, y});
  return static_cast<std::size_t>(std::lround(sample.y)) *
             static_cast<std::size_t>(layers.frame.samples.x) +
         static_cast<std::size_t>(std::lround(sample.x));
}

TEST(Traversability, OfAPlaneIsItsSlopeAndTheClearanceOnLevelGround) {
  // On a disc of 0.25 m, two cells, the plane falls most between two samples 0.5 m apart along x.
  for (const glm::dvec2 slope : {glm::dvec2(0), glm::dvec2(0.5, 0), glm::dvec2(-0.25, 0)}) {
    const TraversabilityLayers layers =
        layers_of(ground_of(41, [&](double x, double y) { return 7 + slope.x * x + slope.y * y; }));
    const std::size_t middle = at(layers, 0, 0);
    EXPECT_EQ(layers.elevation_m[middle], 7);
    EXPECT_NEAR(layers.slope_deg[middle], std::atan(std::abs(slope.x)) * degrees, 1e-5);
    EXPECT_NEAR(layers.roughness_m[middle], 0, rounding_m);
    EXPECT_NEAR(layers.step_m[middle], 0.5 * std::abs(slope.x), rounding_m);
    EXPECT_NEAR(layers.clearance_m[middle], vehicle.clearance_m, rounding_m);
    EXPECT_EQ(layers.belly_contact[middle], 0);
    EXPECT_EQ(layers.verdict[middle], 0);
  }
}

TEST(Traversability, OfAnObliquePlaneIsItsSlope) {
  const glm::dvec2 slope(0.25, -0.375);
  const TraversabilityLayers layers =
      layers_of(ground_of(41, [&](double x, double y) { return slope.x * x + slope.y * y; }));
  for (std::size_t i = 0; i < layers.slope_deg.size(); ++i) {
    if (layers.verdict[i] == no_verdict) continue;
    EXPECT_NEAR(layers.slope_deg[i], std::atan(std::hypot(slope.x, slope.y)) * degrees, 1e-5);
    EXPECT_NEAR(layers.clearance_m[i], vehicle.clearance_m, rounding_m);
  }
}

// A roof of slopes s: over its crest the axles are s b / 2 below it, with wheelbase b; at other
// headings less, as long as the wheelbase is longer than the track.
TEST(Traversability, ClearanceOverTheCrestOfTwoRampsHasAClosedForm) {
  for (const double s : {0.1, 0.25, 0.375}) {
    const TraversabilityLayers layers =
        layers_of(ground_of(41, [&](double x, double) { return -s * std::abs(x); }));
    const double expected_m = vehicle.clearance_m - s * vehicle.wheelbase_m / 2;
    EXPECT_NEAR(layers.clearance_m[at(layers, 0, 0)], expected_m, rounding_m) << s;
    EXPECT_NEAR(layers.slope_deg[at(layers, 0, 0)], 0, 1e-5);
    EXPECT_EQ(layers.belly_contact[at(layers, 0, 0)], expected_m <= 0 ? 1 : 0);
    EXPECT_EQ(layers.verdict[at(layers, 0, 0)],
              expected_m <= 0 ? static_cast<int>(GroundObstacle::Clearance) : 0);
  }
}

// At the foot of a ramp, heading east, the rear axle is on level ground and the front axle on the
// ramp. The ground is convex, so that an end of the tilted underbody is nearest to it.
TEST(Traversability, ClearanceAtTheFootOfARampHasAClosedForm) {
  constexpr double s = 0.5;
  const auto ramp_m = [](double x) { return s * std::max(0.0, x); };
  const TraversabilityLayers layers =
      layers_of(ground_of(61, [&](double x, double) { return ramp_m(x); }), 1);
  for (const double x : {-0.75, -0.5, -0.25, 0.0, 0.25}) {
    const double front_m = ramp_m(x + vehicle.wheelbase_m / 2);
    const double pitch = front_m / vehicle.wheelbase_m, half_m = vehicle.length_m / 2;
    const double ahead_m = ramp_m(x + half_m) - (front_m / 2 + pitch * half_m);
    const double behind_m = ramp_m(x - half_m) - (front_m / 2 - pitch * half_m);
    EXPECT_NEAR(layers.clearance_m[at(layers, x, 0)],
                vehicle.clearance_m - std::max(ahead_m, behind_m) / std::hypot(1, pitch),
                rounding_m)
        << x;
  }
}

// A narrow ridge between the axles touches the underbody if it is as high as the clearance.
TEST(Traversability, UnderbodyTouchesRidgesThatAreAsHighAsTheClearance) {
  for (const double height_m : {0.125, 0.2421875, 0.25, 0.3125}) {
    const TraversabilityLayers layers = layers_of(ground_of(
        41, [&](double x, double) { return height_m * std::max(0.0, 1 - std::abs(x) / cell_m); }));
    const std::size_t middle = at(layers, 0, 0);
    EXPECT_NEAR(layers.clearance_m[middle], vehicle.clearance_m - height_m, rounding_m);
    EXPECT_EQ(layers.belly_contact[middle], height_m >= vehicle.clearance_m ? 1 : 0);
    EXPECT_NEAR(layers.step_m[middle], height_m, rounding_m);
    EXPECT_EQ(layers.verdict[middle], height_m >= vehicle.clearance_m ? 8 : 0);
    // Beside the underbody at all headings, and within the grid.
    const std::size_t beside = at(layers, 1.25, 0);
    EXPECT_NEAR(layers.clearance_m[beside], vehicle.clearance_m, rounding_m);
    EXPECT_EQ(layers.belly_contact[beside], 0);
  }
}

// The least squares plane of a step of height h at the middle of a disc has the slope
// sum(x z) / sum(x^2), and the step is h wherever both of its sides are in the window.
TEST(Traversability, StepsAreAsHighAsTheyAre) {
  constexpr double height_m = 0.1875;
  const TraversabilityLayers layers =
      layers_of(ground_of(41, [](double x, double) { return x > 0 ? height_m : 0; }));
  for (const double x : {-1.25, -0.5, -0.25, -0.125, 0.0, 0.125, 0.25, 0.375, 0.5, 1.25}) {
    const bool has_edge = -vehicle.wheel_radius_m < x && x <= vehicle.wheel_radius_m;
    EXPECT_EQ(layers.step_m[at(layers, x, 0)], has_edge ? float{height_m} : 0.0F) << x;
  }
  double moment = 0, covariance = 0;
  const double radius_m = std::hypot(vehicle.length_m, vehicle.width_m) / 2;
  for (double x = -1.125; x <= 1.125; x += cell_m) {
    for (double y = -1.125; y <= 1.125; y += cell_m) {
      if (std::hypot(x, y) > radius_m) continue;
      moment += x * x;
      covariance += x > 0 ? x * height_m : 0;
    }
  }
  EXPECT_NEAR(layers.slope_deg[at(layers, 0, 0)], std::atan(covariance / moment) * degrees, 1e-5);
}

HeightGrid noise(int side, double sd_m, double trend) {
  return ground_of(side, [&](double x, double y) {
    const glm::dvec2 sample = glm::dvec2(x, y) / cell_m + 1000.0;
    const RandomKey key{Seed{5}, 0, 0,
                        static_cast<std::uint32_t>(std::lround(2000 * sample.y + sample.x))};
    return trend * x + sd_m * random_normal(key).x;
  });
}

// n residuals about a plane have n - 3 degrees of freedom: their mean square is
// sd^2 (n - 3) / n.
TEST(Traversability, RoughnessOfNoiseIsItsStandardDeviation) {
  constexpr double sd_m = 0.05;
  for (const double trend : {0.0, 0.25}) {
    const TraversabilityLayers layers = layers_of(noise(241, sd_m, trend));
    const double n =
        static_cast<double>(disc_stencil(vehicle.half_diagonal_m(), cell_m, 1000).offsets.size());
    double sum = 0, count = 0;
    for (const float roughness_m : layers.roughness_m) {
      if (std::isnan(roughness_m)) continue;
      sum += double{roughness_m} * double{roughness_m};
      ++count;
    }
    // Variances of all samples' squares: 2 sd^4 / samples; 4 standard deviations, and what samples
    // at the border weigh less.
    const double tolerance = 4 * std::sqrt(2.0) / std::sqrt(count) * sd_m * sd_m;
    EXPECT_NEAR(sum / count * n / (n - 3), sd_m * sd_m, tolerance);
  }
}

// The least gap at a lattice of points of the underbody, by the surface's own query.
double slow_clearance_m(const HeightGrid& ground, glm::dvec2 p, double heading, double spacing_m) {
  const glm::dvec2 ahead(std::cos(heading), std::sin(heading)), left(-ahead.y, ahead.x);
  const auto height_m = [&](double x, double y) {
    return *ground.height_m_at(p + x * ahead + y * left);
  };
  const double x = vehicle.wheelbase_m / 2, y = vehicle.track_m / 2;
  const std::array<double, 4> wheels{height_m(x, y), height_m(x, -y), height_m(-x, y),
                                     height_m(-x, -y)};
  const double mean_m = (wheels[0] + wheels[1] + wheels[2] + wheels[3]) / 4;
  const double pitch = (wheels[0] + wheels[1] - wheels[2] - wheels[3]) / (4 * x);
  const double roll = (wheels[0] + wheels[2] - wheels[1] - wheels[3]) / (4 * y);
  double highest_m = -1e9;
  for (double u = -vehicle.length_m / 2; u <= vehicle.length_m / 2; u += spacing_m) {
    for (double v = -vehicle.width_m / 2; v <= vehicle.width_m / 2; v += spacing_m)
      highest_m = std::max(highest_m, height_m(u, v) - mean_m - pitch * u - roll * v);
  }
  return vehicle.clearance_m - highest_m / std::sqrt(1 + pitch * pitch + roll * roll);
}

// The layer is never more than at any point, and less by no more than the surface rises between
// points of the lattice: slopes are below 6 sd / cell, of noise.
TEST(Traversability, ClearanceIsTheLeastOverAllPointsOfTheUnderbody) {
  constexpr int headings = 5;
  constexpr double sd_m = 0.01, spacing_m = 1.0 / 128;
  const HeightGrid ground = noise(61, sd_m, 0.3);
  const TraversabilityLayers layers = layers_of(ground, headings);
  for (const glm::dvec2 p : {glm::dvec2(0), glm::dvec2(0.5, -1), glm::dvec2(-1.5, 1.25)}) {
    double slow_m = 1e9;
    for (int k = 0; k < headings; ++k) {
      slow_m =
          std::min(slow_m, slow_clearance_m(ground, p, std::numbers::pi * k / headings, spacing_m));
    }
    const double least_m = layers.clearance_m[at(layers, p.x, p.y)];
    EXPECT_LE(least_m, slow_m + rounding_m);
    EXPECT_GE(least_m, slow_m - 6 * sd_m / cell_m * spacing_m * std::numbers::sqrt2);
  }
}

TEST(Traversability, ValuesAreMissingWhereASampleTheyNeedIs) {
  const HeightGrid ground = ground_of(61, [](double x, double y) {
    return x == 0 && y == 0 ? std::numeric_limits<double>::quiet_NaN() : 1;
  });
  const TraversabilityLayers layers = layers_of(ground);
  const double plane_m = vehicle.half_diagonal_m();
  for (double x = -3.75; x <= 3.75; x += cell_m) {
    for (double y = -3.75; y <= 3.75; y += cell_m) {
      const std::size_t i = at(layers, x, y);
      const double border_m = 3.75 - std::max(std::abs(x), std::abs(y));
      const double apart_m = std::hypot(x, y);
      EXPECT_EQ(std::isnan(layers.elevation_m[i]), apart_m == 0);
      const bool has_step = apart_m > vehicle.wheel_radius_m && border_m >= vehicle.wheel_radius_m;
      EXPECT_EQ(std::isnan(layers.step_m[i]), !has_step) << x << ' ' << y;
      const bool has_plane = apart_m > plane_m && border_m >= 1;
      EXPECT_EQ(std::isnan(layers.slope_deg[i]), !has_plane) << x << ' ' << y;
      EXPECT_EQ(layers.verdict[i] == no_verdict,
                !has_step || !has_plane || std::isnan(layers.clearance_m[i]));
      EXPECT_EQ(layers.belly_contact[i] == no_verdict, std::isnan(layers.clearance_m[i]));
    }
  }
  EXPECT_TRUE(std::isnan(layers.clearance_m[at(layers, 0.5, 0)]));
  EXPECT_FALSE(std::isnan(layers.clearance_m[at(layers, 1.5, 0)]));
}

TEST(Traversability, VerdictsListAllObstacles) {
  const HeightGrid ground = noise(61, 0.05, 0.25);
  TraversabilitySpec spec{.cell_m = cell_m, .vehicle = vehicle};
  spec.limits = {.slope_deg = 14, .roughness_m = 0.05, .step_m = 0.25, .least_clearance_m = 0.05};
  const TraversabilityLayers layers = traversability(ground, spec, memory_bytes);
  std::array<std::size_t, 4> counts{};
  for (std::size_t i = 0; i < layers.verdict.size(); ++i) {
    if (layers.verdict[i] == no_verdict) continue;
    const std::array<bool, 4> is_blocked{layers.slope_deg[i] > 14, layers.roughness_m[i] > 0.05F,
                                         layers.step_m[i] > 0.25F, layers.clearance_m[i] <= 0.05F};
    for (std::size_t bit = 0; bit < counts.size(); ++bit) {
      EXPECT_EQ((layers.verdict[i] >> bit & 1) != 0, is_blocked[bit]);
      counts[bit] += is_blocked[bit] ? 1 : 0;
    }
  }
  EXPECT_EQ(count_verdicts(layers).obstacles, counts);
  for (const std::size_t count : counts) EXPECT_GT(count, 0);
}

TEST(Traversability, HeightsAreThoseOfTheGroundBetweenItsSamples) {
  const HeightGrid ground = noise(61, 0.05, 0.25);
  constexpr double finer_m = 0.1;
  const TraversabilityLayers layers =
      traversability(ground, {.cell_m = finer_m, .vehicle = vehicle}, memory_bytes);
  ASSERT_EQ(layers.frame.samples, glm::ivec2(76));
  for (int row = 0; row < 76; ++row) {
    for (int column = 0; column < 76; ++column) {
      const glm::dvec2 p = glm::clamp(layers.frame.to_D({column, row}), -3.75, 3.75);
      EXPECT_EQ(layers.elevation_m[static_cast<std::size_t>(row * 76 + column)],
                static_cast<float>(*ground.height_m_at(p)));
    }
  }
}

std::string fault_of(const TraversabilitySpec& spec, std::size_t bytes = memory_bytes) {
  try {
    traversability(ground_of(41, [](double, double) { return 0.0; }), spec, bytes);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Traversability, RejectsInvalidSizes) {
  using testing::HasSubstr;
  TraversabilitySpec spec{.cell_m = cell_m, .vehicle = vehicle};
  spec.vehicle.track_m = -1;
  spec.headings = 0;
  EXPECT_THAT(fault_of(spec), HasSubstr("track_m = -1 must be a length above 0"));
  EXPECT_THAT(fault_of(spec), HasSubstr("headings = 0 must be 1 to 360"));
  spec = {.cell_m = 0.5, .vehicle = vehicle};
  EXPECT_THAT(fault_of(spec), HasSubstr("wheel_radius_m = 0.25 is less than a cell, 0.5 m"));
  spec = {.cell_m = 0.001, .vehicle = vehicle};
  EXPECT_THAT(fault_of(spec), HasSubstr("is more than 1000 cells of 0.001 m; make cells larger"));
  spec = {.cell_m = cell_m, .vehicle = vehicle};
  EXPECT_THAT(fault_of(spec, 10'000), HasSubstr("make cell_m (now 0.125) larger"));
  spec.vehicle.length_m = 20;
  EXPECT_THAT(fault_of(spec), HasSubstr("are its sizes in metres?"));
}

}  // namespace
}  // namespace groundray::traversability_test
