#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include "terrain/scatter/dart_field.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::adsorption_test {
namespace {

using std::numbers::pi;

// Random sequential adsorption of discs of diameter 1 on a periodic square of `side` x `side`: a
// thrown disc stays unless it overlaps an earlier one.
class DiscSquare {
 public:
  DiscSquare(int side, std::uint64_t seed)
      : side_(side), cells_(static_cast<int>(std::ceil(side * std::numbers::sqrt2))), draw_(seed) {
    discs_.resize(static_cast<std::size_t>(cells_) * static_cast<std::size_t>(cells_), {-1, -1});
  }

  // Throws discs until their total area per unit area is `thrown`; returns the fraction covered.
  double coverage_after(double thrown) {
    std::poisson_distribution<int> count((thrown - thrown_) / (pi / 4) * side_ * side_);
    thrown_ = thrown;
    for (int i = count(draw_); i > 0; --i) add(uniform() * side_, uniform() * side_);
    return standing_ * (pi / 4) / (side_ * side_);
  }

 private:
  struct Disc {
    double x, y;
  };
  double uniform() { return static_cast<double>(draw_() >> 11) * 0x1p-53; }
  Disc& disc(int column, int row) {
    const auto wrap = [&](int i) { return static_cast<std::size_t>((i + cells_) % cells_); };
    return discs_[wrap(row) * static_cast<std::size_t>(cells_) + wrap(column)];
  }
  void add(double x, double y) {
    const int column = static_cast<int>(x / side_ * cells_);  // a cell has room for one disc
    const int row = static_cast<int>(y / side_ * cells_);
    const auto apart = [&](double a, double b) {
      return std::min(std::abs(a - b), side_ - std::abs(a - b));
    };
    for (int i = -2; i <= 2; ++i) {
      for (int j = -2; j <= 2; ++j) {
        const Disc& other = disc(column + i, row + j);
        if (other.x >= 0 && std::hypot(apart(x, other.x), apart(y, other.y)) < 1) return;
      }
    }
    disc(column, row) = {x, y};
    ++standing_;
  }

  double side_;
  int cells_;
  std::mt19937_64 draw_;
  std::vector<Disc> discs_;
  double thrown_ = 0;
  double standing_ = 0;
};

// The documented error is 2e-4 of the coverage. In addition, the mean of the runs may deviate by
// 4.8 of its standard errors, estimated with 15 degrees of freedom: a probability of 1e-3 over all
// six (Šidák).
TEST(AdsorptionProof, ThrownDiscsReachTheRequestedCoverage) {
  const double coverages[] = {0.05, 0.15, 0.25, 0.35, 0.42, max_adsorption_coverage};
  constexpr int runs = 16;
  const int side = static_cast<int>(testing::proof_size(120, 600));
  std::vector<std::vector<double>> reached(std::size(coverages));
  for (std::uint64_t run = 0; run < runs; ++run) {
    DiscSquare square(side, 1000 + run);
    for (std::size_t i = 0; i < std::size(coverages); ++i) {
      reached[i].push_back(square.coverage_after(thrown_for(coverages[i])));
    }
  }
  for (std::size_t i = 0; i < std::size(coverages); ++i) {
    double mean = 0, variance = 0;
    for (const double c : reached[i]) mean += c / runs;
    for (const double c : reached[i]) variance += (c - mean) * (c - mean) / (runs - 1);
    const double error = std::sqrt(variance / runs);
    EXPECT_NEAR(mean, coverages[i], 2e-4 * coverages[i] + 4.8 * error);
    RecordProperty(
        "coverage_" + std::to_string(coverages[i]),
        std::to_string(mean / coverages[i] - 1) + " +- " + std::to_string(error / coverages[i]));
  }
}

// 1 - 4 c + 6 sqrt(3) / pi c^2 + (40 / (sqrt(3) pi) - 176 / (3 pi^2)) c^3 is exact to third order:
// its terms are the overlap of two exclusion discs, and of three. The remainder is of the order of
// 10 c^4.
TEST(Adsorption, FreeShareMatchesTheExactExpansionAtLowCoverage) {
  for (const double c : {0.0, 1e-3, 1e-2, 3e-2}) {
    EXPECT_NEAR(free_share(c), 1 - 4 * c + 3.307973 * c * c + 1.406853 * c * c * c,
                20 * c * c * c * c + 1e-15 + 1e-6 * c * c);
  }
}

TEST(Adsorption, DerivativeOfThrownIsTheInverseFreeShare) {
  // Central differences have an error of h^2 / 6 of the third derivative: below 1e-6 of the
  // derivative.
  constexpr double h = 1e-5;
  for (const double c : {0.01, 0.2, 0.3, 0.44}) {
    const double slope = (thrown_for(c + h) - thrown_for(c - h)) / (2 * h);
    EXPECT_NEAR(slope * free_share(c), 1, 1e-5);
  }
  EXPECT_EQ(thrown_for(0), 0);
}

}  // namespace
}  // namespace groundray::adsorption_test
