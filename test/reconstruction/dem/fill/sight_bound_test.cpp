#include "reconstruction/dem/fill/sight_bound.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include "core/error.h"
#include "core/geometry/height_grid.h"
#include "reconstruction/dem/fill/dem_fill.h"
#include "test/support/margin.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::sight_bound_test {
namespace {

using testing::fractal;
using ::testing::HasSubstr;
using testing::proof_size;

// Row-major index of a raster's sample.
std::size_t index_of(int column, int row, int columns) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
         static_cast<std::size_t>(column);
}

GridFrame frame_of(glm::ivec2 samples, glm::dvec2 step_m) {
  return {.samples = samples, .origin_m = {5, 7}, .step_m = step_m, .cells_per_m = 1.0 / step_m};
}

// Bounds are floats, rounded up.
void expect_bound(float found_m, double true_m) {
  if (std::isinf(true_m)) {
    EXPECT_TRUE(std::isnan(found_m));
    return;
  }
  EXPECT_GE(double{found_m}, true_m - 1e-9);
  EXPECT_LE(double{found_m}, true_m + 1e-9 + 1e-6 * std::abs(true_m));
}

TEST(SightBound, LinesBoundSamplesWithinHalfACellOfTheirFootPoints) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-10, 40);
  for (const glm::dvec2 step_m : {glm::dvec2(1, -1), glm::dvec2(1, 1), glm::dvec2(2, -0.5)}) {
    const GridFrame frame = frame_of({20, 24}, step_m);
    std::vector<SightLine> lines(40);
    for (SightLine& line : lines) {
      line = {{uniform(random), uniform(random) - 12, uniform(random)},
              {uniform(random), uniform(random) - 12, uniform(random)}};
    }
    lines.push_back({{10, 0, 5}, {10, 0, 1}});  // vertical
    const auto found_m = sight_bound(frame, {}, lines, 0.25);
    for (int row = 0; row < 24; ++row) {
      for (int column = 0; column < 20; ++column) {
        const glm::dvec2 at(column, row);
        double least_m = std::numeric_limits<double>::infinity();
        for (const SightLine& line : lines) {
          const glm::dvec2 a = frame.to_grid(glm::dvec2(line.origin_m));
          const glm::dvec2 along = frame.to_grid(glm::dvec2(line.end_m)) - a;
          const double t = glm::dot(at - a, along) / glm::dot(along, along);
          if (!(0 <= t && t <= 1) || glm::distance(at, a + t * along) > 0.5) continue;
          least_m = std::min(least_m, glm::mix(line.origin_m.z, line.end_m.z, t) + 0.25);
        }
        expect_bound(found_m[index_of(column, row, 20)], least_m);
      }
    }
  }
}

// The space between a face and its origin is a tetrahedron: its lowest point above a sample is the
// lowest height at which the vertical line through the sample enters or leaves it.
TEST(SightBound, FacesBoundSamplesByTheLowestPointOfTheObservedSpace) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(-4, 24);
  const GridFrame frame = frame_of({16, 18}, {1, -1});
  for (int round = 0; round < 20; ++round) {
    OcclusionFaces faces;
    const glm::dvec3 origin_m(uniform(random), uniform(random) - 10, 30);
    for (int k = 0; k < 3; ++k) {
      faces.shape.vertices_m.emplace_back(uniform(random), uniform(random) - 10, uniform(random));
      faces.origins_m.push_back(origin_m);
    }
    faces.shape.triangles = {{0, 1, 2}};
    const auto found_m = sight_bound(frame, faces, {}, 0);
    const std::array p{faces.shape.vertices_m[0], faces.shape.vertices_m[1],
                       faces.shape.vertices_m[2], origin_m};
    for (int row = 0; row < 18; ++row) {
      for (int column = 0; column < 16; ++column) {
        // Lowest intersection of the vertical line through the sample with the tetrahedron's four
        // faces.
        const glm::dvec2 q = frame.to_D({column, row});
        double least_m = std::numeric_limits<double>::infinity();
        for (int left_out = 0; left_out < 4; ++left_out) {
          std::array<glm::dvec3, 3> t;
          for (int k = 0, n = 0; k < 4; ++k)
            if (k != left_out) t[static_cast<std::size_t>(n++)] = p[static_cast<std::size_t>(k)];
          const glm::dmat2 sides(glm::dvec2(t[1] - t[0]), glm::dvec2(t[2] - t[0]));
          const glm::dvec2 w = glm::inverse(sides) * (q - glm::dvec2(t[0]));
          if (w.x < 0 || w.y < 0 || w.x + w.y > 1) continue;
          least_m = std::min(least_m, t[0].z + w.x * (t[1].z - t[0].z) + w.y * (t[2].z - t[0].z));
        }
        expect_bound(found_m[index_of(column, row, 16)], least_m);
      }
    }
  }
}

// Part of a landscape that a sensor sees, by marching along lines of sight.
struct Seen {
  std::vector<float> heights_m;  // NaN in shadow
  std::vector<SightLine> lines;
  double steepest = 0;
};

bool is_free(const HeightGrid& grid, const SightLine& line) {
  const glm::dvec3 along = line.end_m - line.origin_m;
  const int steps = static_cast<int>(4 * glm::length(glm::dvec2(along)));
  for (int i = 1; i < steps; ++i) {
    const glm::dvec3 p = line.origin_m + along * (static_cast<double>(i) / steps);
    const auto ground_m = grid.height_m_at(glm::dvec2(p));
    if (ground_m && *ground_m > p.z + 1e-9) return false;
  }
  return true;
}

Seen see(const HeightGrid& grid, const std::vector<glm::dvec3>& sensors_m) {
  Seen seen{.heights_m = std::vector<float>(grid.heights_m().size(),
                                            std::numeric_limits<float>::quiet_NaN())};
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      const float height_m = grid.height_m(column, row);
      if (column > 0 && row > 0) {
        for (const float next_m : {grid.height_m(column - 1, row), grid.height_m(column, row - 1)})
          seen.steepest =
              std::max(seen.steepest, std::numbers::sqrt2 * std::abs(double{height_m} - next_m));
      }
      for (const glm::dvec3& sensor_m : sensors_m) {
        const SightLine line{sensor_m, {grid.frame().to_D({column, row}), height_m}};
        if (!is_free(grid, line)) continue;
        seen.lines.push_back(line);
        seen.heights_m[index_of(column, row, grid.columns())] = height_m;
      }
    }
  }
  return seen;
}

double rms_m(const HeightGrid& grid, std::span<const float> holed_m,
             std::span<const float> filled_m) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < holed_m.size(); ++i) {
    if (!std::isnan(holed_m[i]) || std::isnan(filled_m[i])) continue;
    const double error_m = double{filled_m[i]} - grid.heights_m()[i];
    sum += error_m * error_m;
    ++count;
  }
  return std::sqrt(sum / count);
}

TEST(SightBoundProof, BoundsHoldBehindCrestsAndReduceErrors) {
  const auto rounds = static_cast<std::uint64_t>(proof_size(4, 10));
  double free_m2 = 0, held_m2 = 0, sound_m2 = 0;
  for (std::uint64_t seed = 1; seed <= rounds; ++seed) {
    const HeightGrid grid = fractal(129, 1, 60, Seed{seed});
    const double angle = static_cast<double>(seed);
    std::vector<glm::dvec3> sensors_m;
    for (const double turn : {0.0, 2.0}) {
      const glm::dvec2 at = 50.0 * glm::dvec2(std::cos(angle + turn), std::sin(angle + turn));
      sensors_m.emplace_back(at, grid.height_m_at(at).value() + 8);
    }
    const Seen seen = see(grid, sensors_m);
    // With a margin for the steepest slope the bound holds everywhere; without a margin, nearly
    // everywhere.
    const auto sound_m = sight_bound(grid.frame(), {}, seen.lines, seen.steepest / 2);
    const auto most_m = sight_bound(grid.frame(), {}, seen.lines, 0);
    for (std::size_t i = 0; i < sound_m.size(); ++i)
      EXPECT_FALSE(grid.heights_m()[i] > sound_m[i]) << i;
    const FillOptions options{.farthest_m = 1000, .largest_share = 1};
    const FilledHeights sound = fill_dem(grid.frame(), seen.heights_m, sound_m, options);
    sound_m2 += std::pow(rms_m(grid, seen.heights_m, sound.heights_m), 2);
    const FilledHeights free = fill_dem(grid.frame(), seen.heights_m, {}, options);
    const FilledHeights held = fill_dem(grid.frame(), seen.heights_m, most_m, options);
    free_m2 += std::pow(rms_m(grid, seen.heights_m, free.heights_m), 2);
    held_m2 += std::pow(rms_m(grid, seen.heights_m, held.heights_m), 2);
  }
  const double ratio = std::sqrt(held_m2 / free_m2);
  EXPECT_LE(ratio, 0.97);
  testing::record_margin("errors in shadows by bounds of sight", ratio, 0.97);
  const double sound_ratio = std::sqrt(sound_m2 / free_m2);
  EXPECT_LE(sound_ratio, 1);
  testing::record_margin("errors in shadows by bounds that hold everywhere", sound_ratio, 1);
}

TEST(SightBound, RejectsInvalidInput) {
  OcclusionFaces faces;
  faces.shape.vertices_m = {{0, 0, 0}, {1, 0, 0}};
  faces.shape.triangles = {{0, 1, 2}};
  const std::vector<SightLine> lines{{{0, 0, 1}, {NAN, 0, 0}}};
  try {
    (void)sight_bound(frame_of({4, 4}, {1, -1}), faces, lines, -1);
    FAIL();
  } catch (const Error& error) {
    for (const char* fault :
         {"margin_m = -1", "2 vertices and 0 origins",
          "face 0 refers to a vertex that does not exist", "line of sight 0 is not"})
      EXPECT_THAT(error.what(), HasSubstr(fault));
  }
}

}  // namespace
}  // namespace groundray::sight_bound_test
