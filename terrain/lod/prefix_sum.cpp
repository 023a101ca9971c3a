#include "terrain/lod/prefix_sum.h"

#include <algorithm>
#include <memory>

#include "terrain/lod/passes/prefix_sum.h"

namespace groundray {
namespace {

template <typename Sum, typename Replace, typename T>
std::uint64_t sum_up_parts(T* values, std::size_t size, const PassRunner& runner) {
  const auto length = static_cast<std::size_t>(std::max(2, runner.run_samples));
  passes::Parts<T> parts{values, size, length, nullptr};
  const auto sums = std::make_unique_for_overwrite<std::uint64_t[]>(parts.count());
  parts.sums = sums.get();
  run_pass(runner, parts.count(), Sum{parts});
  const std::uint64_t total = parts.count() == 1
                                  ? sums[0]
                                  : sum_up_parts<passes::SumSumsPass, passes::ReplaceSumsPass>(
                                        sums.get(), parts.count(), runner);
  run_pass(runner, parts.count(), Replace{parts});
  return total;
}

}  // namespace

std::uint64_t sum_up(std::uint32_t* counts, std::size_t size, const PassRunner& runner) {
  if (size == 0) return 0;
  return sum_up_parts<passes::SumCountsPass, passes::ReplaceCountsPass>(counts, size, runner);
}

}  // namespace groundray
