#include "reconstruction/mesh/scan/ascending_memory.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <list>
#include <vector>

namespace groundray::ascending_memory_test {
namespace {

TEST(AscendingMemory, AddressesAscendEvenAfterDeallocation) {
  const AscendingMemory memory(100'000);
  std::list<double, AscendingAllocator<double>> numbers;
  const double* last = nullptr;
  for (int i = 0; i < 1000; ++i) {
    numbers.push_back(i);
    EXPECT_TRUE(memory.owns(&numbers.back()));
    EXPECT_LT(last, &numbers.back());
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(&numbers.back()) % alignof(double), 0u);
    last = &numbers.back();
    if (i % 3 == 0) numbers.pop_front();
  }
}

TEST(AscendingMemory, FallsBackToTheHeapAndReportsIt) {
  const AscendingMemory memory(100);
  const std::vector<int, AscendingAllocator<int>> few(10, 1);
  EXPECT_FALSE(memory.is_used_up());
  const std::vector<int, AscendingAllocator<int>> many(1000, 2);
  EXPECT_TRUE(memory.is_used_up());
  EXPECT_TRUE(memory.owns(few.data()));
  EXPECT_FALSE(memory.owns(many.data()));
  EXPECT_EQ(many.back(), 2);
}

TEST(AscendingMemory, AllocatorWorksWithoutIt) {
  const std::vector<int, AscendingAllocator<int>> numbers(1000, 3);
  EXPECT_EQ(numbers.back(), 3);
}

}  // namespace
}  // namespace groundray::ascending_memory_test
