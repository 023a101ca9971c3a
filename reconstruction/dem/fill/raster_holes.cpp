#include "reconstruction/dem/fill/raster_holes.h"

#include <algorithm>
#include <cstddef>
#include <glm/ext/vector_int2_sized.hpp>
#include <utility>

namespace groundray {
namespace {

using Place = glm::i64vec2;

// Returns twice the area of a triangle: positive if c lies to the left of a -> b.
std::int64_t turn(Place a, Place b, Place c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// Returns one side of the convex hull of positions that ascend by rows.
std::vector<Place> chain_of(const std::vector<Place>& places, std::int64_t side) {
  std::vector<Place> chain;
  for (const Place place : places) {
    while (chain.size() > 1 && side * turn(chain[chain.size() - 2], chain.back(), place) <= 0)
      chain.pop_back();
    chain.push_back(place);
  }
  return chain;
}

// Returns the columns of a chain at each row from its first to its last.
template <typename Round>
std::vector<std::int64_t> columns_of(const std::vector<Place>& chain, const Round& round) {
  std::vector<std::int64_t> columns;
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
    const Place a = chain[i], b = chain[i + 1];
    for (std::int64_t row = a.y; row < b.y; ++row)
      columns.push_back(a.x + round((b.x - a.x) * (row - a.y), b.y - a.y));
  }
  columns.push_back(chain.back().x);
  return columns;
}

// Returns n / d rounded down, for d > 0.
std::int64_t floor_of(std::int64_t n, std::int64_t d) { return n / d - (n % d < 0 ? 1 : 0); }
std::int64_t ceiling_of(std::int64_t n, std::int64_t d) { return -floor_of(-n, d); }

}  // namespace

std::vector<std::vector<std::uint32_t>> linked_samples(glm::ivec2 size,
                                                       std::span<const std::uint8_t> is_wanted) {
  std::vector<std::uint8_t> is_open(is_wanted.begin(), is_wanted.end());
  std::vector<std::vector<std::uint32_t>> sets;
  for (std::uint32_t first = 0; first < is_open.size(); ++first) {
    if (std::exchange(is_open[first], std::uint8_t{0}) == 0) continue;
    std::vector<std::uint32_t> set{first};
    for (std::size_t i = 0; i < set.size(); ++i) {
      const int column = static_cast<int>(set[i]) % size.x, row = static_cast<int>(set[i]) / size.x;
      for (int r = std::max(row - 1, 0); r <= std::min(row + 1, size.y - 1); ++r) {
        for (int c = std::max(column - 1, 0); c <= std::min(column + 1, size.x - 1); ++c) {
          const auto other = static_cast<std::uint32_t>(r * size.x + c);
          if (std::exchange(is_open[other], std::uint8_t{0}) != 0) set.push_back(other);
        }
      }
    }
    std::ranges::sort(set);
    sets.push_back(std::move(set));
  }
  return sets;
}

std::vector<std::uint8_t> inside_hull(glm::ivec2 size, std::span<const std::uint8_t> has_data) {
  std::vector<Place> first, last;  // samples with data, of each row that has any
  for (int row = 0; row < size.y; ++row) {
    const auto begin = has_data.begin() + static_cast<std::ptrdiff_t>(row) * size.x;
    const auto one = std::find_if(begin, begin + size.x, [](auto is) { return is != 0; });
    if (one == begin + size.x) continue;
    int end = size.x - 1;
    while (begin[end] == 0) --end;
    first.emplace_back(one - begin, row);
    last.emplace_back(end, row);
  }
  std::vector<std::uint8_t> is_inside(has_data.size());
  if (first.empty()) return is_inside;
  const auto lows = columns_of(chain_of(first, -1), ceiling_of);
  const auto highs = columns_of(chain_of(last, 1), floor_of);
  for (std::size_t i = 0; i < lows.size(); ++i) {
    const auto row = first.front().y + static_cast<std::int64_t>(i);
    for (std::int64_t column = lows[i]; column <= highs[i]; ++column)
      is_inside[static_cast<std::size_t>(row * size.x + column)] = 1;
  }
  return is_inside;
}

}  // namespace groundray
