#include "terrain/lod/prefix_sum.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "core/random.h"
#include "test/support/terrain/shuffled_runner.h"

namespace groundray::prefix_sum_test {
namespace {

std::vector<std::uint32_t> random_counts(std::size_t size, double most) {
  std::vector<std::uint32_t> counts;
  for (std::uint32_t i = 0; i < size; ++i)
    counts.push_back(static_cast<std::uint32_t>(most * random_uniform({Seed{1}, 0, 0, i}).x));
  return counts;
}

TEST(PrefixSum, IsTheSumOfTheCountsBefore) {
  for (const std::size_t size : {0, 1, 2, 3, 4, 5, 255, 256, 257, 5000}) {
    // Totals above 2^32, too: the counts are then replaced modulo 2^32.
    for (const double most : {3.0, 4e9}) {
      const std::vector<std::uint32_t> counts = random_counts(size, most);
      std::vector<std::uint32_t> expected;
      std::uint64_t total = 0;
      for (const std::uint32_t count : counts) {
        expected.push_back(static_cast<std::uint32_t>(total));
        total += count;
      }
      for (const int length : {1, 2, 4, 256}) {
        PassRunner runner = testing::shuffled_runner(Seed{2});
        runner.run_samples = length;
        std::vector<std::uint32_t> found = counts;
        EXPECT_EQ(sum_up(found.data(), size, runner), total);
        EXPECT_EQ(found, expected) << size << " counts, parts of " << length;
      }
    }
  }
}

}  // namespace
}  // namespace groundray::prefix_sum_test
