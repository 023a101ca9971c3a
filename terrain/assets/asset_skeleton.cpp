#include "terrain/assets/asset_skeleton.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "core/math.h"

namespace groundray {
namespace {

struct Goal {
  glm::dvec3 p;
  double distance = std::numeric_limits<double>::infinity();  // to the nearest joint
  std::size_t nearest = 0;
};

std::vector<Goal> scatter_goals(const CrownShape& crown, AssetRandom& random) {
  std::vector<Goal> goals;
  while (goals.size() < static_cast<std::size_t>(crown.points)) {
    const glm::dvec3 direction = random.direction();
    // Denser towards the outside, where there is more light.
    const double r = math::pow(random.between(0, 1), 0.28);
    const glm::dvec3 p = crown.center + crown.half * direction * r;
    if (p.z >= crown.lowest) goals.push_back({p});
  }
  return goals;
}

// Growth of a joint: sum of the unit directions to the goals that it is nearest to.
struct Pull {
  glm::dvec3 sum{0};
  bool is_near = false;
};

}  // namespace

void colonise(Skeleton& wood, const CrownShape& crown, AssetRandom& random) {
  std::vector<Goal> goals = scatter_goals(crown, random);
  std::size_t seen = 0;  // number of joints that have been compared with the goals
  constexpr int max_rounds = 200;
  for (int round = 0; round < max_rounds && !goals.empty(); ++round) {
    for (; seen < wood.size(); ++seen) {
      for (Goal& goal : goals) {
        const double distance = glm::distance(goal.p, wood[seen].p);
        if (distance < goal.distance) goal = {goal.p, distance, seen};
      }
    }
    std::erase_if(goals, [&](const Goal& goal) { return goal.distance < crown.reach; });
    std::vector<Pull> pulls(wood.size());
    for (const Goal& goal : goals) {
      if (goal.distance > crown.sight) continue;
      pulls[goal.nearest].sum += (goal.p - wood[goal.nearest].p) / goal.distance;
      pulls[goal.nearest].is_near = true;
    }
    const std::size_t count = wood.size();
    for (std::size_t i = 0; i < count; ++i) {
      if (!pulls[i].is_near) continue;
      const glm::dvec3 pull = glm::normalize(pulls[i].sum + 1e-9 * random.direction());
      const glm::dvec3 before = wood[i].parent ? glm::normalize(wood[i].p - wood[*wood[i].parent].p)
                                               : glm::dvec3(0, 0, 1);
      // Wood is stiff, grows slightly towards the light and is never quite straight.
      const glm::dvec3 along =
          glm::normalize(pull + 0.35 * before + glm::dvec3(0, 0, 0.12) + 0.25 * random.direction());
      wood.push_back({wood[i].p + along * crown.step, i});
    }
    if (wood.size() == count) return;
  }
}

void thicken(Skeleton& wood, double foot_radius) {
  for (SkeletonNode& node : wood) node.tips = 0;
  for (std::size_t i = wood.size(); i-- > 0;) {
    wood[i].tips = std::max(wood[i].tips, 1);
    if (wood[i].parent) wood[*wood[i].parent].tips += wood[i].tips;
  }
  int most = 1;
  for (const SkeletonNode& node : wood) most = std::max(most, node.tips);
  for (SkeletonNode& node : wood) node.radius = foot_radius * std::sqrt(double(node.tips) / most);
}

void prune(Skeleton& wood, const std::vector<char>& is_kept) {
  std::vector<std::size_t> number(wood.size(), 0);
  std::size_t count = 0;
  for (std::size_t i = 0; i < wood.size(); ++i) {
    if (!is_kept[i]) continue;
    number[i] = count;
    wood[count] = wood[i];
    if (wood[i].parent) wood[count].parent = number[*wood[i].parent];
    ++count;
  }
  wood.resize(count);
}

void wither(Skeleton& wood, double health, AssetRandom& random) {
  if (health == 1) return;
  int most = 1;
  for (const SkeletonNode& node : wood) most = std::max(most, node.tips);
  const int small = std::clamp(most / 12, 1, 20);  // twig ends of a branch that dies as a whole
  constexpr double kept_twigs = 0.3;
  std::vector<char> is_kept(wood.size(), 1);
  for (std::size_t i = 0; i < wood.size(); ++i) {
    if (!wood[i].parent) continue;
    const SkeletonNode& parent = wood[*wood[i].parent];
    const bool is_whole = parent.tips <= small && parent.parent.has_value();
    wood[i].is_alive = is_whole                ? parent.is_alive
                       : wood[i].tips <= small ? random.between(0, 1) < health
                                               : parent.is_alive;
    const bool is_lost =
        !wood[i].is_alive && wood[i].tips == 1 && random.between(0, 1) > kept_twigs;
    is_kept[i] = is_kept[*wood[i].parent] != 0 && !is_lost ? 1 : 0;
  }
  prune(wood, is_kept);
}

void break_off(Skeleton& wood, double height, AssetRandom& random) {
  constexpr double breaks = 0.13;  // chance that a branch breaks at a joint
  std::vector<char> is_kept(wood.size(), 1);
  for (std::size_t i = 0; i < wood.size(); ++i) {
    if (!wood[i].parent) continue;
    const SkeletonNode& parent = wood[*wood[i].parent];
    const bool is_stem = wood[i].tips * 2 > parent.tips && !parent.bears_twigs;
    const bool is_broken = wood[i].p.z > height || (!is_stem && random.between(0, 1) < breaks);
    is_kept[i] = is_kept[*wood[i].parent] != 0 && !is_broken ? 1 : 0;
  }
  prune(wood, is_kept);
}

}  // namespace groundray
