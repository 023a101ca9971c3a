#include "terrain/scatter/competition.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>
#include <tuple>
#include <unordered_map>

namespace groundray {
namespace {

auto rank(const Contender& plant) { return std::tuple(-plant.height_m, plant.species, plant.key); }

bool yields(const Contender& plant, const Contender& taller) {
  const double apart_m = std::max({plant.min_distance_m, taller.min_distance_m,
                                   (1 - plant.tolerance) * (plant.zone_m + taller.zone_m)});
  const glm::dvec2 between_m = plant.p_m - taller.p_m;
  return glm::dot(between_m, between_m) < apart_m * apart_m;
}

// Survivors in square cells, as wide as the farthest that a plant reaches.
class Cells {
 public:
  explicit Cells(double side_m) : side_m_(side_m) {}

  void add(std::size_t plant, glm::dvec2 p_m) { cells_[key(cell(p_m))].push_back(plant); }

  template <typename Test>
  bool any_near(glm::dvec2 p_m, const Test& test) const {
    const glm::ivec2 middle = cell(p_m);
    for (int y = middle.y - 1; y <= middle.y + 1; ++y) {
      for (int x = middle.x - 1; x <= middle.x + 1; ++x) {
        const auto found = cells_.find(key({x, y}));
        if (found != cells_.end() && std::ranges::any_of(found->second, test)) return true;
      }
    }
    return false;
  }

 private:
  glm::ivec2 cell(glm::dvec2 p_m) const { return glm::ivec2(glm::floor(p_m / side_m_)); }
  static std::uint64_t key(glm::ivec2 cell) {
    return std::uint64_t{static_cast<std::uint32_t>(cell.y)} << 32 |
           static_cast<std::uint32_t>(cell.x);
  }

  double side_m_;
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> cells_;
};

}  // namespace

std::vector<std::size_t> survivors(std::span<const Contender> plants) {
  double reach_m = 0.1;  // so that cells are not tiny
  for (const Contender& plant : plants)
    reach_m = std::max({reach_m, plant.min_distance_m, 2 * plant.zone_m});
  std::vector<std::size_t> order(plants.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return rank(plants[i]); });
  Cells standing(reach_m);
  std::vector<std::size_t> found;
  for (const std::size_t i : order) {
    const Contender& plant = plants[i];
    if (standing.any_near(plant.p_m,
                          [&](std::size_t other) { return yields(plant, plants[other]); }))
      continue;
    standing.add(i, plant.p_m);
    found.push_back(i);
  }
  std::ranges::sort(found);
  return found;
}

}  // namespace groundray
