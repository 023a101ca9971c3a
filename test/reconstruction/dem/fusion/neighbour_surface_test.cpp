#include "reconstruction/dem/fusion/neighbour_surface.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>

#include "core/random.h"

namespace groundray::neighbour_surface_test {
namespace {

constexpr std::ptrdiff_t stride = 5;
constexpr std::size_t middle = 12;
constexpr glm::dvec2 step_m(0.25, 0.5);

double normal(std::uint32_t what, std::size_t i) {
  return random_normal({.seed = Seed{31}, .frame = what, .pulse = static_cast<std::uint32_t>(i)}).x;
}

using Window = std::array<GroundGuess, 25>;

// Heights are those of `ground`, a function of the offset from the centre in cells.
template <typename Ground>
Window window_of(const Ground& ground, double sd_m) {
  Window window;
  for (std::size_t i = 0; i < window.size(); ++i) {
    const std::size_t row = i / 5, column = i % 5;
    const double u = static_cast<double>(column) - 2, v = static_cast<double>(row) - 2;
    window[i].height_m = ground(u, v);
    window[i].variance_m2 = static_cast<float>(sd_m * sd_m);
  }
  return window;
}

NeighbourSurface surface_of(const Window& window, const GroundScatter& scatter) {
  const NeighbourSketch sketch = sketch_neighbours(&window[middle], stride, step_m, 1);
  return neighbour_surface(&window[middle], stride, step_m, 1, sketch, scatter);
}

TEST(NeighbourSurface, ReproducesQuadraticSurfaces) {
  const auto ground = [](double u, double v) {
    return 100 + 0.05 * u - 0.1 * v + 0.01 * u * u - 0.02 * u * v + 0.005 * v * v;
  };
  const NeighbourSurface got = surface_of(window_of(ground, 1e-3), {1, 1e-6});
  EXPECT_EQ(got.cells, 24);
  EXPECT_NEAR(got.plane.height_m, 100, 1e-4);
  EXPECT_NEAR(got.plane.slope_x, 0.05 / step_m.x, 1e-3);
  EXPECT_NEAR(got.plane.slope_y, -0.1 / step_m.y, 1e-3);
  EXPECT_NEAR(got.bend.xx, 0.02, 1e-3);
  EXPECT_NEAR(got.bend.xy, -0.02, 1e-3);
  EXPECT_NEAR(got.bend.yy, 0.01, 1e-3);
}

// Neither the cell itself nor five cells that are 5 m off move the surface.
TEST(NeighbourSurface, IgnoresOutliersAndTheCellItself) {
  Window window = window_of([](double u, double v) { return 0.1 * u - 0.05 * v; }, 0.005);
  for (const std::size_t wrong : {0U, 4U, 6U, 12U, 18U, 23U}) window[wrong].height_m += 5;
  const NeighbourSurface got = surface_of(window, {1e-4, 1e-4});
  EXPECT_NEAR(got.plane.height_m, 0, 0.005);
  EXPECT_NEAR(got.plane.slope_x, 0.1 / step_m.x, 0.02);
  EXPECT_NEAR(got.plane.slope_y, -0.05 / step_m.y, 0.02);
}

TEST(NeighbourSurface, WithoutNeighboursOnlyThePriorSlopeRemains) {
  Window window;
  const NeighbourSurface got = surface_of(window, {});
  EXPECT_EQ(got.cells, 0);
  EXPECT_DOUBLE_EQ(got.xx, 1);
  EXPECT_DOUBLE_EQ(got.information_yy, 1);
  EXPECT_EQ(got.group, no_group);
}

// Points treated as exact, on ground hundreds of metres high.
TEST(NeighbourSurface, RoughnessOfHighMountainsIsFinite) {
  Window window;
  for (std::size_t i = 0; i < window.size(); ++i) {
    window[i].height_m = 1000 * normal(9, i);
    window[i].variance_m2 = 1e-8F;
  }
  const NeighbourSketch sketch = sketch_neighbours(&window[middle], stride, {300, 300}, 1);
  EXPECT_GT(sketch.rough_m2, 1e4F);
  EXPECT_TRUE(std::isfinite(sketch.rough_m2));
  EXPECT_TRUE(std::isfinite(sketch.rough_m4));
}

// Rough ground of known variance under noise that is equal everywhere or varies by a factor of 6,
// as between one point and 36: a sketch's roughness is unbiased, and as uncertain as stated. The
// mean of 4000 windows scatters by 2 %, and Cauchy's weights remove up to 20 %. A surface follows
// its precise cells, so that under uneven noise their residuals are smaller, which nothing
// compensates: half of the roughness must remain.
TEST(NeighbourSurface, RoughnessUnderNoiseIsUnbiased) {
  constexpr double rough_m = 0.008;
  constexpr std::uint32_t windows = 4000;
  for (const std::array<double, 3>& noise_m :
       {std::array{0.03, 0.012, 0.005}, std::array{0.01, 0.01, 0.01}, std::array{0.0, 0.0, 0.0}}) {
    double sum = 0, squares = 0, reported = 0;
    for (std::uint32_t trial = 0; trial < windows; ++trial) {
      Window window = window_of([](double u, double v) { return 0.02 * u + 0.01 * v; }, 0);
      for (std::size_t i = 0; i < window.size(); ++i) {
        const double sd_m = noise_m[i % 3];
        const std::size_t name = std::size_t{25} * trial + i;
        window[i].variance_m2 = static_cast<float>(sd_m * sd_m + 1e-8);
        window[i].height_m += sd_m * normal(1, name) + rough_m * normal(2, name);
      }
      const NeighbourSketch got = sketch_neighbours(&window[middle], stride, step_m, 1);
      sum += double{got.rough_m2};
      squares += double{got.rough_m2} * double{got.rough_m2};
      reported += double{got.rough_m4};
    }
    const double mean_m2 = sum / windows;
    const bool is_even = noise_m[0] == noise_m[1];
    EXPECT_GT(mean_m2 / (rough_m * rough_m), is_even ? 0.8 : 0.5) << noise_m[0];
    EXPECT_LT(mean_m2 / (rough_m * rough_m), 1.2) << noise_m[0];
    EXPECT_NEAR(std::sqrt((squares / windows - mean_m2 * mean_m2) / (reported / windows)), 1, 0.3)
        << noise_m[0];
  }
}

// The stated variances of the surface match the noise of its cells and the ground's roughness: 10^4
// windows.
TEST(NeighbourSurface, StatedErrorsOfHeightsAndSlopesAreCorrect) {
  constexpr double noise_m = 0.01, rough_m = 0.006;
  constexpr std::uint32_t windows = 10000;
  double height = 0, slope = 0;
  for (std::uint32_t trial = 0; trial < windows; ++trial) {
    Window window = window_of([](double, double) { return 0.0; }, noise_m);
    for (std::size_t i = 0; i < window.size(); ++i)
      window[i].height_m = std::hypot(noise_m, rough_m) * normal(3, std::size_t{25} * trial + i);
    const double rough_m2 = rough_m * rough_m;
    const NeighbourSurface got = surface_of(window, {rough_m2, rough_m2});
    const double own_m = rough_m * normal(4, trial);  // roughness of the cell itself
    height += std::pow(got.plane.height_m - own_m, 2) / got.height_variance_m2;
    // With white roughness the slopes are those of the surface: the stated part of the cell's own
    // slope is additional.
    const double fitted = got.xx - 1.8 * rough_m2 / (step_m.x * step_m.x);
    slope += got.plane.slope_x * got.plane.slope_x / fitted;
  }
  EXPECT_NEAR(std::sqrt(height / windows), 1, 0.05);
  EXPECT_NEAR(std::sqrt(slope / windows), 1, 0.1);
}

}  // namespace
}  // namespace groundray::neighbour_surface_test
