#include "reconstruction/dem/fill/sorted_holes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/ext/vector_int2_sized.hpp>
#include <numeric>
#include <utility>

#include "reconstruction/dem/thin_plate/thin_plate_system.h"

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

constexpr double usual_farthest_cells = 50;

using Sets = std::vector<std::vector<std::uint32_t>>;

// Returns the connected sets of samples without data for which `is_inside` is `side`, 0 or 1.
Sets empty_samples(glm::ivec2 size, std::span<const std::uint8_t> has_data,
                   std::span<const std::uint8_t> is_inside, std::uint8_t side) {
  std::vector<std::uint8_t> is_wanted(has_data.size());
  for (std::size_t i = 0; i < has_data.size(); ++i)
    is_wanted[i] = has_data[i] == 0 && is_inside[i] == side ? 1 : 0;
  return linked_samples(size, is_wanted);
}

RasterHole describe_hole(glm::ivec2 size, const std::vector<std::uint32_t>& set,
                         std::span<const float> to_data_m) {
  RasterHole hole{.first = size, .last = glm::ivec2(-1), .samples = set.size()};
  for (const std::uint32_t sample : set) {
    const glm::ivec2 at(static_cast<int>(sample) % size.x, static_cast<int>(sample) / size.x);
    hole.first = glm::min(hole.first, at);
    hole.last = glm::max(hole.last, at);
    hole.farthest_m = std::max(hole.farthest_m, double{to_data_m[sample]});
  }
  return hole;
}

bool touches_edge(const RasterHole& hole, glm::ivec2 size) {
  return std::min(hole.first.x, hole.first.y) == 0 || hole.last.x == size.x - 1 ||
         hole.last.y == size.y - 1;
}

// Returns the fate of a hole within the reach.
HoleFate fate_of(const RasterHole& hole, const GridFrame& frame, const FillOptions& options) {
  const double cell_m = std::sqrt(std::abs(frame.step_m.x * frame.step_m.y));
  if (hole.farthest_m > options.farthest_m.value_or(usual_farthest_cells * cell_m))
    return HoleFate::TooFar;
  const double all = static_cast<double>(frame.samples.x) * frame.samples.y;
  if (static_cast<double>(hole.samples) > options.largest_share * all) return HoleFate::TooLarge;
  return HoleFate::Filled;
}

// Sorts holes by their first samples.
void order(SortedHoles& sorted) {
  std::vector<std::size_t> places(sorted.holes.size());
  std::iota(places.begin(), places.end(), std::size_t{0});
  std::ranges::sort(places, {}, [&](std::size_t i) { return sorted.samples[i].front(); });
  SortedHoles ordered;
  for (const std::size_t i : places) {
    ordered.holes.push_back(sorted.holes[i]);
    ordered.samples.push_back(std::move(sorted.samples[i]));
  }
  sorted = std::move(ordered);
}

}  // namespace

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

SortedHoles sort_holes(const GridFrame& frame, std::span<const std::uint8_t> has_data,
                       std::span<const float> to_data_m, const FillOptions& options) {
  const glm::ivec2 size = frame.samples;
  std::vector<std::uint8_t> is_inside(has_data.size(), 1);
  if (options.reach == FillReach::Hull) is_inside = inside_hull(size, has_data);
  SortedHoles sorted;
  sorted.samples = empty_samples(size, has_data, is_inside, 1);
  for (const auto& set : sorted.samples) {
    RasterHole& hole = sorted.holes.emplace_back(describe_hole(size, set, to_data_m));
    const bool is_open = options.reach == FillReach::Enclosed && touches_edge(hole, size);
    hole.fate = is_open ? HoleFate::Open : fate_of(hole, frame, options);
  }
  for (auto& set : empty_samples(size, has_data, is_inside, 0)) {
    sorted.holes.emplace_back(describe_hole(size, set, to_data_m)).fate = HoleFate::Open;
    sorted.samples.push_back(std::move(set));
  }
  order(sorted);
  sorted.numbers.resize(has_data.size());
  std::ranges::transform(has_data, sorted.numbers.begin(),
                         [](std::uint8_t has) { return has != 0 ? known_sample : absent_sample; });
  for (std::size_t i = 0; i < sorted.holes.size(); ++i) {
    RasterHole& hole = sorted.holes[i];
    if (hole.fate != HoleFate::Filled) continue;
    if (!has_known_neighbour(size, sorted.numbers, sorted.samples[i]))
      hole.fate = HoleFate::NoGround;
    if (hole.fate != HoleFate::Filled) continue;
    for (const std::uint32_t sample : sorted.samples[i])
      sorted.numbers[sample] = static_cast<std::int32_t>(i);
  }
  return sorted;
}

}  // namespace groundray
