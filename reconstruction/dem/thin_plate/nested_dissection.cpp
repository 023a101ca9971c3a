#include "reconstruction/dem/thin_plate/nested_dissection.h"

#include <algorithm>
#include <glm/common.hpp>
#include <limits>
#include <numeric>
#include <optional>

namespace groundray {
namespace {

constexpr std::size_t most_together = 48;  // samples that are not divided further

// Separator of samples: `reach` columns or rows from `first` on.
struct Cut {
  int axis = 0, first = 0;
  double cost = 0;  // samples on it per sample of the smaller side
};

class Dissector {
 public:
  Dissector(std::span<const glm::ivec2> places, int reach) : places_(places), reach_(reach) {
    found_.order.resize(places.size());
    std::iota(found_.order.begin(), found_.order.end(), 0);
  }

  Dissection run() {
    part(0, found_.order.size());
    return std::move(found_);
  }

 private:
  std::size_t part(std::size_t begin, std::size_t end);
  std::optional<Cut> best_cut(std::span<const std::int32_t> samples);
  void try_axis(std::span<const std::int32_t> samples, int axis, int low, int high,
                std::optional<Cut>& best);

  std::span<const glm::ivec2> places_;
  int reach_;
  std::vector<std::size_t> before_;  // cumulative numbers of samples by column or row
  Dissection found_;
};

// Dissects samples of the order; returns the number of the last part.
std::size_t Dissector::part(std::size_t begin, std::size_t end) {
  const std::span<std::int32_t> samples(found_.order.data() + begin, end - begin);
  const auto cut = samples.size() > most_together ? best_cut(samples) : std::nullopt;
  if (!cut) {
    found_.parts.push_back({begin, end});
    return found_.parts.size() - 1;
  }
  const auto side = [&](std::int32_t sample) {
    const int at = places_[static_cast<std::size_t>(sample)][cut->axis];
    return at < cut->first ? 0 : at >= cut->first + reach_ ? 1 : 2;
  };
  std::ranges::stable_sort(samples, {}, side);
  const auto begin_of = [&](int of) {
    return begin + static_cast<std::size_t>(std::ranges::lower_bound(samples, of, {}, side) -
                                            samples.begin());
  };
  const std::size_t second = begin_of(1), line = begin_of(2);
  const std::size_t one = part(begin, second), other = part(second, line);
  found_.parts.push_back({line, end, {one, other}});
  return found_.parts.size() - 1;
}

// Returns the separator with the fewest samples relative to the smaller side.
std::optional<Cut> Dissector::best_cut(std::span<const std::int32_t> samples) {
  glm::ivec2 low(std::numeric_limits<int>::max()), high(std::numeric_limits<int>::min());
  for (const std::int32_t sample : samples) {
    low = glm::min(low, places_[static_cast<std::size_t>(sample)]);
    high = glm::max(high, places_[static_cast<std::size_t>(sample)]);
  }
  std::optional<Cut> best;
  const int longer = high.x - low.x >= high.y - low.y ? 0 : 1;
  for (const int axis : {longer, 1 - longer}) try_axis(samples, axis, low[axis], high[axis], best);
  return best;
}

void Dissector::try_axis(std::span<const std::int32_t> samples, int axis, int low, int high,
                         std::optional<Cut>& best) {
  const auto lines = static_cast<std::size_t>(high - low) + 1;
  const auto wide = static_cast<std::size_t>(reach_);
  before_.assign(lines + 1, 0);
  for (const std::int32_t sample : samples)
    ++before_[static_cast<std::size_t>(places_[static_cast<std::size_t>(sample)][axis] - low) + 1];
  std::partial_sum(before_.begin(), before_.end(), before_.begin());
  for (std::size_t first = 1; first + wide < lines; ++first) {
    const std::size_t one = before_[first], on = before_[first + wide] - one;
    const std::size_t smaller = std::min(one, samples.size() - one - on);
    if (smaller == 0) continue;
    const double cost = static_cast<double>(on + 1) / static_cast<double>(smaller);
    if (!best || cost < best->cost) best = Cut{axis, low + static_cast<int>(first), cost};
  }
}

}  // namespace

Dissection dissect(std::span<const glm::ivec2> places, int reach) {
  return Dissector(places, reach).run();
}

}  // namespace groundray
