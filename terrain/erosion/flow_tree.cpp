#include "terrain/erosion/flow_tree.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

namespace groundray {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Returns whether a sample is at the border or beside a missing height.
bool is_outlet(const SampleGrid& grid, std::span<const double> heights_m, std::size_t at) {
  int count = 0;
  grid.each_neighbour(at, [&](std::size_t next, double) { count += !std::isnan(heights_m[next]); });
  return count < 8;
}

}  // namespace

std::vector<double> FlowTree::areas_m2(double sample_m2) const {
  std::vector<double> areas(receivers.size(), sample_m2);
  for (std::size_t i = order.size(); i-- > 0;) {
    const std::uint32_t at = order[i];
    if (receivers[at] != at) areas[receivers[at]] += areas[at];
  }
  return areas;
}

FlowTree flow_tree(const SampleGrid& grid, std::span<const double> heights_m) {
  FlowTree tree{.order = {},
                .receivers = std::vector<std::uint32_t>(grid.count()),
                .distances_m = std::vector<double>(grid.count())};
  tree.order.reserve(grid.count());
  std::vector<double> surface_m(grid.count(), infinity);  // of the water, or of dry ground
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  for (std::size_t i = 0; i < grid.count(); ++i) {
    if (std::isnan(heights_m[i]) || !is_outlet(grid, heights_m, i)) continue;
    surface_m[i] = heights_m[i];
    tree.receivers[i] = static_cast<std::uint32_t>(i);
    open.emplace(surface_m[i], static_cast<std::uint32_t>(i));
  }
  while (!open.empty()) {
    const std::uint32_t at = open.top().second;
    open.pop();
    tree.order.push_back(at);
    // All neighbours whose surface is lower have been here; the steepest of them is the receiver.
    double steepest = 0;
    grid.each_neighbour(at, [&](std::size_t next, double distance_m) {
      if (std::isnan(heights_m[next])) return;
      if (surface_m[next] == infinity) {
        surface_m[next] = std::max(heights_m[next], surface_m[at]);
        tree.receivers[next] = at;
        tree.distances_m[next] = distance_m;
        open.emplace(surface_m[next], static_cast<std::uint32_t>(next));
        return;
      }
      const double slope = (surface_m[at] - surface_m[next]) / distance_m;
      if (tree.receivers[at] == at || !(slope > steepest)) return;
      steepest = slope;
      tree.receivers[at] = static_cast<std::uint32_t>(next);
      tree.distances_m[at] = distance_m;
    });
  }
  return tree;
}

}  // namespace groundray
