#include "reconstruction/dem/thin_plate/bounded_solver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "reconstruction/dem/thin_plate/ldlt.h"
#include "reconstruction/dem/thin_plate/thin_plate_system.h"
#include "test/reconstruction/dem/difference_plate.h"

namespace groundray::bounded_solver_test {
namespace {

using testing::difference_plate;
using testing::DifferencePlate;

// Conditions that identify the minimum below bounds: nothing exceeds its bound, samples at their
// bounds would rise without them, and all others satisfy their equations. Returns the number of
// samples at their bounds.
int check_least(const DifferencePlate& plate, const std::vector<double>& right,
                const std::vector<double>& most, const std::vector<double>& z) {
  const auto found = plate.matrix.times(z);
  int at_bound = 0;
  double largest = 1e-300;
  for (const double height : z) largest = std::max(largest, std::abs(height));
  const double tolerance = 1e-10 * largest;  // a difference of order 3 sums 1e2 rounding errors
  for (std::size_t i = 0; i < z.size(); ++i) {
    EXPECT_LE(z[i], most[i]);
    const double push = right[i] - found[i];
    EXPECT_GE(push, -tolerance);
    if (z[i] < most[i]) {
      EXPECT_LE(push, tolerance);
    } else {
      ++at_bound;
    }
  }
  return at_bound;
}

TEST(BoundedSolver, FindsTheMinimumUnderBoundsEvenForStiffPlates) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(-1, 1);
  constexpr double none = std::numeric_limits<double>::infinity();
  for (const int order : {1, 2, 3}) {
    const DifferencePlate plate = difference_plate({40, 32}, order);
    const Dissection dissection = dissect(plate.places, order);
    std::vector<double> right(plate.matrix.size()), most(right.size()), start;
    for (const double bounded : {0.02, 0.3, 1.0}) {
      for (std::size_t i = 0; i < right.size(); ++i) {
        right[i] = uniform(random) + 0.3;
        most[i] = uniform(random) + 1 < 2 * bounded ? 4 + 3 * uniform(random) : none;
      }
      BoundedSolver descent(plate.matrix, dissection, right, most);
      EXPECT_TRUE(descent.run({}));
      EXPECT_GT(check_least(plate, right, most, descent.heights()), 0);
      // From another start, too.
      BoundedSolver again(plate.matrix, dissection, right, most);
      EXPECT_TRUE(again.run(start));
      check_least(plate, right, most, again.heights());
      start = descent.heights();
    }
  }
}

// A few samples far below a stiff plate bend all of it, so that finding the active bounds takes
// long.
TEST(ThinPlateSystem, FindsTheMinimumOfStiffPlatesUnderFewLowBounds) {
  constexpr int side = 36, wide = side + 6, every = 5;
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(-1, 1);
  std::vector<float> heights_m;
  std::vector<std::int32_t> numbers(std::size_t{wide} * wide, known_sample);
  std::vector<std::uint32_t> samples;
  std::vector<double> most_m;
  for (int row = 0; row < wide; ++row) {
    for (int column = 0; column < wide; ++column) {
      const auto at = static_cast<std::uint32_t>(row * wide + column);
      const double hills_m = 5 * std::sin(row * 0.05) + 3 * std::cos(column * 0.07);
      heights_m.push_back(static_cast<float>(hills_m) + uniform(random));
      if (std::min(row, column) < 3 || std::max(row, column) >= wide - 3) continue;
      numbers[at] = static_cast<std::int32_t>(samples.size());
      most_m.push_back((7 * row + column) % every == 0 ? 0 : std::nan(""));
      samples.push_back(at);
    }
  }
  const ThinPlateRaster raster{{wide, wide}, {1, 1}, heights_m, numbers};
  ThinPlateSystem system(raster, samples), other(raster, samples);
  const BoundedThinPlate found = system.solve_below({0, 5}, most_m);
  EXPECT_TRUE(found.is_best);
  EXPECT_GT(found.at_bound, 10u);
  // The minimum is unique, wherever the search starts.
  (void)other.solve_below({0, 5}, std::vector<double>(samples.size(), -3));
  const BoundedThinPlate again = other.solve_below({0, 5}, most_m);
  EXPECT_TRUE(again.is_best);
  EXPECT_EQ(again.at_bound, found.at_bound);
  for (std::size_t i = 0; i < samples.size(); ++i)
    EXPECT_NEAR(again.heights_m[i], found.heights_m[i], 1e-6);
}

TEST(BoundedSolver, HandlesAllOrNoBoundsActive) {
  const DifferencePlate plate = difference_plate({20, 20}, 2);
  const Dissection dissection = dissect(plate.places, 2);
  const std::vector<double> right(400, 0);
  for (const double bound : {1.0, 0.0, -1.0}) {
    const std::vector<double> most(400, bound);
    BoundedSolver descent(plate.matrix, dissection, right, most);
    EXPECT_TRUE(descent.run({}));
    check_least(plate, right, most, descent.heights());
  }
}

}  // namespace
}  // namespace groundray::bounded_solver_test
