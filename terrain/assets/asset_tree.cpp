// Shrubs and trees: growth of their wood, and places of the sprays that bear their leaves.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numbers>
#include <vector>

#include "core/math.h"
#include "terrain/assets/asset_kinds.h"
#include "terrain/assets/asset_plant.h"
#include "terrain/assets/asset_skeleton.h"

namespace groundray {
namespace {

// Places sprays on living twigs, in all directions but preferably outward and along the twig.
std::vector<Spray> scatter_sprays(const Plant& plant, const glm::dvec3& center, std::size_t count,
                                  AssetRandom& random) {
  const Skeleton& wood = plant.wood;
  std::vector<std::size_t> twigs;
  for (std::size_t i = 0; i < wood.size(); ++i) {
    if (wood[i].parent && wood[i].is_alive && wood[i].tips <= 3) twigs.push_back(i);
  }
  std::vector<Spray> sprays;
  for (std::size_t i = 0; i < count && !twigs.empty(); ++i) {
    const SkeletonNode& node = wood[twigs[i * twigs.size() / count]];
    const glm::dvec3 from = wood[*node.parent].p;
    const glm::dvec3 base = glm::mix(from, node.p, random.between(0, 1));
    const glm::dvec3 along = glm::normalize(node.p - from) + 0.6 * glm::normalize(base - center) +
                             0.9 * random.direction();
    sprays.push_back(spray_on(base, along, random.direction()));
  }
  return sprays;
}

// Adds a nearly straight stem that starts below the ground.
void add_stem(Skeleton& wood, const glm::dvec3& foot, const glm::dvec3& head, double step,
              AssetRandom& random) {
  const int pieces = std::max(2, static_cast<int>(std::lround(glm::distance(foot, head) / step)));
  wood.push_back({foot, {}});
  for (int i = 1; i <= pieces; ++i) {
    const glm::dvec3 p = glm::mix(foot, head, static_cast<double>(i) / pieces);
    wood.push_back({p + 0.12 * step * random.direction(), wood.size() - 1});
  }
}

// Makes goals more numerous and, in proportion, closer together. Leaves as geometry need fine wood.
void refine(CrownShape& crown, const AssetShape& shape) {
  const double detail = shape.leaves == LeafModel::Cards ? shape.detail : 2;
  crown.points = static_cast<int>(std::lround(crown.points * detail));
  crown.reach *= math::pow(detail, -1.0 / 3);
  crown.step = std::min(crown.step, crown.reach / 1.4);
}

}  // namespace

Model make_broadleaf_tree(AssetShape shape) {
  Plant plant;
  AssetRandom& random = shape.random;
  const double lean = random.angle_rad();
  const glm::dvec3 fork{0.015 * math::cos(lean), 0.015 * math::sin(lean),
                        random.between(0.26, 0.34)};
  CrownShape crown{.center = {0, 0, 0.62},
                   .half = {random.between(0.27, 0.33), random.between(0.27, 0.33), 0.35},
                   .points = 260,
                   .step = 0.035,
                   .sight = 0.4,
                   .reach = 0.06};
  refine(crown, shape);
  add_stem(plant.wood, {0, 0, -0.03}, fork, 0.05, random);
  colonise(plant.wood, crown, random);
  thicken(plant.wood, 0.5 / 45);  // height / diameter = 45: stable below 80 (Wonn, O'Hara, 2001)
  wither(plant.wood, shape.health, random);
  plant.wood_budget = scaled_count(900, shape.detail);
  plant.sprays = scatter_sprays(plant, crown.center, spray_count(plant, shape, 540), random);
  return assemble(plant, shape);
}

Model make_shrub(AssetShape shape) {
  Plant plant;
  AssetRandom& random = shape.random;
  CrownShape crown{.center = {0, 0, 0.42},
                   .half = {random.between(0.5, 0.6), random.between(0.5, 0.6), 0.5},
                   .points = 240,
                   .step = 0.055,
                   .sight = 0.7,
                   .reach = 0.1,
                   .lowest = 0.12};
  refine(crown, shape);
  constexpr int stem_count = 5;
  const double turn = random.angle_rad();
  for (int i = 0; i < stem_count; ++i) {
    const double angle = turn + 2 * std::numbers::pi * (i + random.between(-0.3, 0.3)) / stem_count;
    const glm::dvec3 out{math::cos(angle), math::sin(angle), 0};
    const glm::dvec3 head = out * random.between(0.12, 0.24) + glm::dvec3(0, 0, 0.2);
    add_stem(plant.wood, out * 0.03 - glm::dvec3(0, 0, 0.05), head, 0.07, random);
  }
  colonise(plant.wood, crown, random);
  thicken(plant.wood, 0.016);
  wither(plant.wood, shape.health, random);
  plant.wood_budget = scaled_count(800, shape.detail);
  plant.sprays = scatter_sprays(plant, {0, 0, 0.2}, spray_count(plant, shape, 480), random);
  return assemble(plant, shape);
}

namespace {

// Branch of a conifer from the trunk outward, rising near the top and drooping near the ground.
struct Bough {
  glm::dvec3 from;
  double azimuth;
  double length;
  double rise_rad;

  glm::dvec3 at(double s) const {  // s from 0 to 1
    const double flat = length * s, sag = 0.25 * length * s * s;
    return from + glm::dvec3(flat * math::cos(azimuth), flat * math::sin(azimuth),
                             flat * math::tan(rise_rad) - sag + 0.5 * sag * s);
  }
};

std::vector<Bough> boughs_of_conifer(int count, AssetRandom& random) {
  constexpr double lowest = 0.08, golden_rad = 2.399963229728653, spread = 0.2;
  std::vector<Bough> boughs;
  for (int i = 0; i < count; ++i) {
    // Closer together towards the top, where boughs are shorter.
    const double t = math::pow((i + random.between(0.2, 0.8)) / count, 0.85);
    const double z = lowest + (0.97 - lowest) * t;
    const double length = spread * (math::pow(1 - t, 0.85) + 0.05) * random.between(0.8, 1.1);
    boughs.push_back({{0, 0, z},
                      golden_rad * i + random.between(-0.4, 0.4),
                      length,
                      -0.25 + 0.85 * t + random.between(-0.08, 0.08)});
  }
  return boughs;
}

// Places cards along boughs, in proportion to their length: flat sprays to the left, ahead, to the
// right.
std::vector<Spray> cards_on(const std::vector<Bough>& boughs, std::size_t count,
                            AssetRandom& random) {
  // Cumulative lengths of the boughs. The cards are evenly spaced along all of them.
  std::vector<double> ends;
  for (const Bough& bough : boughs) ends.push_back((ends.empty() ? 0 : ends.back()) + bough.length);
  std::vector<Spray> cards;
  std::size_t at = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double place = (static_cast<double>(i) + 0.5) / static_cast<double>(count) * ends.back();
    while (ends[at] < place) ++at;
    const Bough& bough = boughs[at];
    const double s = 1 - (ends[at] - place) / bough.length;
    const glm::dvec3 base = bough.at(0.1 + 0.9 * s);
    const glm::dvec3 ahead = glm::normalize(bough.at(0.15 + 0.9 * s) - bough.at(0.05 + 0.9 * s));
    const glm::dvec3 left = glm::normalize(glm::cross(glm::dvec3(0, 0, 1), ahead));
    const double turn = (static_cast<double>(i % 3) - 1) * 0.8 + random.between(-0.3, 0.3);
    const glm::dvec3 along = ahead * math::cos(turn) + left * math::sin(turn) -
                             glm::dvec3(0, 0, random.between(0, 0.35));
    const glm::dvec3 side =
        left * math::cos(turn) - ahead * math::sin(turn) + glm::dvec3(0, 0, 0.45 * random.normal());
    cards.push_back(spray_on(base, along, side));
  }
  return cards;
}

}  // namespace

Model make_conifer(AssetShape shape) {
  if (shape.leaves == LeafModel::Geometry) return make_spruce(shape);
  Plant plant;
  plant.spray = SprayKind::Needles;
  add_stem(plant.wood, {0, 0, -0.03}, {0, 0, 1}, 0.05, shape.random);
  const std::vector<Bough> boughs =
      boughs_of_conifer(static_cast<int>(scaled_count(75, shape.detail)), shape.random);
  const std::size_t stem_size = plant.wood.size();
  for (const Bough& bough : boughs) {
    const auto joint =
        static_cast<std::size_t>((bough.from.z + 0.03) / 1.03 * static_cast<double>(stem_size - 1));
    std::size_t parent = joint;
    constexpr int pieces = 5;
    for (int i = 1; i <= pieces; ++i) {
      plant.wood.push_back({bough.at(static_cast<double>(i) / pieces), parent});
      parent = plant.wood.size() - 1;
    }
  }
  thicken(plant.wood, 0.5 / 55);  // height / diameter = 55, as in make_broadleaf_tree
  plant.wood_budget = scaled_count(900, shape.detail);
  plant.sprays = cards_on(boughs, spray_count(plant, shape, 540), shape.random);
  return assemble(plant, shape);
}

}  // namespace groundray
