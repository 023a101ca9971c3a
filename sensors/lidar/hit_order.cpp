#include "sensors/lidar/hit_order.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>

namespace groundray {
namespace {

// Sorts at most `most` hits by range without branches that could be mispredicted: the rank of a hit
// is the number of nearer hits. Returns false if two ranges are equal.
template <std::size_t most>
bool sort_by_counting(std::span<const Hit> hits, std::vector<std::uint32_t>& order) {
  std::array<double, most> range_m;
  range_m.fill(std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < hits.size(); ++i) range_m[i] = hits[i].range_m;
  std::array<std::int64_t, most> nearer{};
  for (std::size_t j = 0; j < hits.size(); ++j) {
    const double other_m = range_m[j];
#pragma omp simd
    for (std::size_t i = 0; i < most; ++i) nearer[i] += other_m < range_m[i] ? 1 : 0;
  }
  std::array<std::uint32_t, most + 1> sorted;
  std::uint64_t taken = 0;
  std::size_t met = 0;
  for (std::uint32_t i = 0; i < hits.size(); ++i) {
    sorted[static_cast<std::size_t>(nearer[i])] = i;  // misses rank behind all hits
    taken |= std::uint64_t{1} << nearer[i];
    met += hits[i] ? 1 : 0;
  }
  order.assign(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(met));
  return (~taken & ((std::uint64_t{1} << met) - 1)) == 0;
}

}  // namespace

void sort_hits(std::span<const Hit> hits, std::vector<std::uint32_t>& order) {
  if (hits.back() && std::ranges::is_sorted(hits, {}, &Hit::range_m)) {
    order.resize(hits.size());
    std::iota(order.begin(), order.end(), 0);
    return;
  }
  if (hits.size() <= 16 && sort_by_counting<16>(hits, order)) return;
  if (hits.size() <= 32 && sort_by_counting<32>(hits, order)) return;
  order.clear();
  for (std::uint32_t i = 0; i < hits.size(); ++i) {
    if (hits[i]) order.push_back(i);
  }
  std::ranges::sort(order, {}, [&](std::uint32_t i) { return std::pair(hits[i].range_m, i); });
}

}  // namespace groundray
