#include "terrain/scatter/dart_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <set>
#include <tuple>
#include <vector>

namespace groundray::dart_field_test {
namespace {

// Identity of a dart: its cell and its number in the cell.
using Name = std::tuple<int, int, std::uint32_t>;
Name name_of(const Dart& dart) { return {dart.cell.x, dart.cell.y, dart.number}; }

// Returns the darts that stand when they are thrown in order of arrival onto an empty plane.
std::set<Name> thrown_in_order(std::vector<Dart> darts, const DartLattice& lattice) {
  std::ranges::sort(darts, {}, &Dart::arrival_per_m2);
  std::vector<glm::dvec2> standing;
  std::set<Name> names;
  for (const Dart& dart : darts) {
    const glm::dvec2 p = (glm::dvec2(dart.cell) + dart.at) * lattice.side_m;
    if (std::ranges::any_of(standing, [&](glm::dvec2 other) {
          return glm::length(p - other) < lattice.min_distance_m;
        })) {
      continue;
    }
    standing.push_back(p);
    names.insert(name_of(dart));
  }
  return names;
}

// The reference covers a square that is 16 cells larger on each side: darts beyond it have no
// influence unless 16 darts in a row block each other.
TEST(DartField, MatchesDartsThrownInOrder) {
  for (const DartLattice& lattice :
       {DartLattice{Seed{1}, 0, 1.0, 7.0, 1.0}, DartLattice{Seed{2}, 5, 2.0, 1.0, 0.7},
        DartLattice{Seed{3}, 0, 0.5, 8.0, 0.3}}) {
    for (const glm::ivec2 first : {glm::ivec2(-7, -9), glm::ivec2(260'000'000, -260'000'000)}) {
      constexpr int size = 16, margin = 16;
      DartField all(lattice, first - margin, glm::ivec2(size + 2 * margin));
      std::vector<Dart> darts;
      for (int i = 0; i < (size + 2 * margin) * (size + 2 * margin); ++i) {
        const glm::ivec2 at(i % (size + 2 * margin), i / (size + 2 * margin));
        const auto [begin, end] = all.in_cell(first - margin + at);
        for (std::size_t k = begin; k < end; ++k) darts.push_back(all.dart(k));
      }
      const std::set<Name> expected = thrown_in_order(darts, lattice);
      int standing = 0;
      DartField field(lattice, first, glm::ivec2(3));  // most cells queried below lie outside it
      for (int i = size * size - 1; i >= 0; --i) {     // in an unrelated order
        const auto [begin, end] = field.in_cell(first + glm::ivec2(i / size, i % size));
        for (std::size_t k = begin; k < end; ++k) {
          EXPECT_EQ(field.stands(k), expected.contains(name_of(field.dart(k))));
          standing += field.stands(k) ? 1 : 0;
        }
      }
      EXPECT_GT(standing, size * size / 8);
    }
  }
}

// The mean and variance of a Poisson distribution are equal. Over 40,000 cells, a mean of 4 has a
// standard error of 0.01 and the variance one of sqrt((2 * 4^2 + 4) / n) = 0.030. The probability
// that either deviates by more than 4.1 standard errors is 1e-4.
TEST(DartField, CountsPerCellFollowThePoissonDistribution) {
  const DartLattice lattice{Seed{4}, 1, 2.0, 1.0, 0};
  DartField field(lattice, {0, 0}, {200, 200});
  double sum = 0, squares = 0;
  for (int i = 0; i < 40'000; ++i) {
    const auto [begin, end] = field.in_cell({i % 200, i / 200});
    const auto n = static_cast<double>(end - begin);
    sum += n;
    squares += n * n;
  }
  const double mean = sum / 40'000;
  EXPECT_NEAR(mean, 4, 4.1 * 0.01);
  EXPECT_NEAR(squares / 40'000 - mean * mean, 4, 4.1 * 0.030);
}

}  // namespace
}  // namespace groundray::dart_field_test
