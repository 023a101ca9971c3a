#include "reconstruction/dem/plate_descent.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "reconstruction/dem/plate_dissection.h"
#include "test/reconstruction/dem/difference_plate.h"

namespace groundray {
namespace {

using testing::difference_plate;
using testing::DifferencePlate;

// What tells the least below bounds from all else: nothing is above them, what is at its bound
// would rise, and the rest has its equations met. Returns how many are at their bounds.
int check_least(const DifferencePlate& plate, const std::vector<double>& right,
                const std::vector<double>& most, const std::vector<double>& z) {
  const auto found = plate.matrix.times(z);
  int at_bound = 0;
  double largest = 1e-300;
  for (const double height : z) largest = std::max(largest, std::abs(height));
  const double tolerance = 1e-10 * largest;  // a difference of order 3 sums up 1e2 roundings
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

TEST(PlateDescent, FindsTheLeastBelowBoundsAlsoOfStiffPlates) {
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
      PlateDescent descent(plate.matrix, dissection, right, most);
      EXPECT_TRUE(descent.run({}));
      EXPECT_GT(check_least(plate, right, most, descent.heights()), 0);
      // From elsewhere, too.
      PlateDescent again(plate.matrix, dissection, right, most);
      EXPECT_TRUE(again.run(start));
      check_least(plate, right, most, again.heights());
      start = descent.heights();
    }
  }
}

TEST(PlateDescent, TakesWhatNeedsNoBoundsAndWhatIsAllHeldDown) {
  const DifferencePlate plate = difference_plate({20, 20}, 2);
  const Dissection dissection = dissect(plate.places, 2);
  const std::vector<double> right(400, 0);
  for (const double bound : {1.0, 0.0, -1.0}) {
    const std::vector<double> most(400, bound);
    PlateDescent descent(plate.matrix, dissection, right, most);
    EXPECT_TRUE(descent.run({}));
    check_least(plate, right, most, descent.heights());
  }
}

}  // namespace
}  // namespace groundray
