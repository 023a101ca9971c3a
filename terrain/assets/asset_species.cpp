// Trees by species and many-stemmed bushes: stems with boughs in whorls or a spiral, which bear
// side shoots. Oaks grow by space colonisation. Lengths are in metres.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <numbers>
#include <vector>

#include "core/math.h"
#include "terrain/assets/asset_kinds.h"
#include "terrain/assets/asset_plant.h"
#include "terrain/assets/asset_skeleton.h"

namespace groundray {
namespace {

constexpr double golden_turn_rad = 2.399963229728653;

// Growth of an axis: pieces of wood of equal length, each turned at random, with a steady bend.
struct Growth {
  double step_m = 0.2;
  double crook = 0;  // random turn at each joint, rad
  double rise = 0;   // of the direction along the whole axis; negative: it droops
};

// Habit of a species. Angles are from the upward vertical.
struct Habit {
  int stems = 1;
  double stem_lean_rad = 0;  // of the outermost of several stems
  double slenderness = 55;   // height / diameter at the foot
  double crown = 0.2;        // largest radius / height
  double clear = 0.1;        // share of a tall tree's stem that is free of boughs
  double widest = 0.05;      // place of the largest radius, as a fraction of the crown
  double roundness = 0.9;    // exponent of the radius above it: 1 for a cone
  int whorl = 1;             // boughs at a joint of the stem
  Growth stem{}, bough{}, shoot{};
  double low_rad = 1.6, high_rad = 0.7;  // angle of the lowest and the topmost boughs
  double shoot_share = 0.5;              // length of a side shoot / rest of the bough
  double shoot_rad = 0.9;                // angle between shoot and bough
  double flatness = 0;                   // 1: side shoots in the bough's plane; 0: all round
  double bare = 0.2;               // share of a bough, from the stem, without shoots and leaves
  double spread = 0.8, droop = 0;  // random and downward share of a twig's direction
  SprayKind spray = SprayKind::Leaves;
  LeafForm leaf{};
};

// Wood of a plant that is growing, and the joints that bear twigs.
struct Growing {
  Skeleton wood;
  std::vector<char> is_twig;  // by joint

  std::size_t add(const glm::dvec3& p, std::optional<std::size_t> parent, bool bears) {
    wood.push_back({p, parent});
    is_twig.push_back(bears ? 1 : 0);
    return wood.size() - 1;
  }
};

// Adds an axis to a joint and returns its joints. Those beyond a share of it bear twigs.
std::vector<std::size_t> grow_axis(Growing& plant, std::size_t from, glm::dvec3 along,
                                   double length, const Growth& growth, double bare,
                                   AssetRandom& random) {
  const int pieces = std::max(3, static_cast<int>(std::lround(length / growth.step_m)));
  std::vector<std::size_t> joints;
  glm::dvec3 p = plant.wood[from].p;
  for (int i = 1; i <= pieces; ++i) {
    along = glm::normalize(along + growth.crook * random.direction() +
                           glm::dvec3(0, 0, growth.rise / pieces));
    p += along * (length / pieces);
    from = plant.add(p, from, i > bare * pieces);
    joints.push_back(from);
  }
  return joints;
}

glm::dvec3 direction_at(double azimuth, double from_vertical) {
  return {math::cos(azimuth) * math::sin(from_vertical),
          math::sin(azimuth) * math::sin(from_vertical), math::cos(from_vertical)};
}

void add_shoots(Growing& plant, const std::vector<std::size_t>& bough, double length,
                const Habit& habit, AssetRandom& random) {
  for (std::size_t i = 0; i + 1 < bough.size(); ++i) {
    const double place = static_cast<double>(i + 1) / static_cast<double>(bough.size());
    if (place < habit.bare) continue;
    const glm::dvec3 p = plant.wood[bough[i]].p;
    const glm::dvec3 along = glm::normalize(plant.wood[bough[i + 1]].p - p);
    const glm::dvec3 left =
        glm::normalize(glm::cross(glm::dvec3(0, 0, 1), along) + 1e-6 * random.direction());
    for (const double sign : {-1.0, 1.0}) {
      const double tilt = (1 - habit.flatness) * random.between(-1.4, 1.4);
      const glm::dvec3 side = sign * left * math::cos(tilt) + glm::dvec3(0, 0, math::sin(tilt));
      const double angle = habit.shoot_rad * random.between(0.8, 1.2);
      const double share = habit.shoot_share * random.between(0.6, 1.1);
      grow_axis(plant, bough[i], along * math::cos(angle) + side * math::sin(angle),
                length * (share * (1 - place) + 0.06), habit.shoot, 0, random);
    }
  }
}

// Radius of the crown at a height, as a fraction of the largest.
double crown_profile(const Habit& habit, double t) {
  if (t < habit.widest) return 0.55 + 0.45 * t / habit.widest;
  return math::pow((1 - t) / (1 - habit.widest), habit.roundness);
}

void add_boughs(Growing& plant, const std::vector<std::size_t>& stem, double height,
                const Habit& habit, AssetRandom& random) {
  // Young trees bear boughs to the ground.
  const double clear = habit.clear * std::clamp((height - 2) / 10, 0.0, 1.0);
  const double foot = std::max(0.04, clear) * height;
  double azimuth = random.angle_rad();
  for (std::size_t i = 0; i + 1 < stem.size(); ++i) {
    const double z = plant.wood[stem[i]].p.z;
    if (z < foot) continue;
    const double t = std::min((z - foot) / (height - foot), 0.99);
    for (int k = 0; k < habit.whorl; ++k) {
      azimuth += habit.whorl == 1 ? golden_turn_rad : 2 * std::numbers::pi / habit.whorl;
      const double length =
          habit.crown * height * (crown_profile(habit, t) * random.between(0.75, 1.1) + 0.03);
      const double angle = glm::mix(habit.low_rad, habit.high_rad, t) + random.between(-0.12, 0.12);
      const auto bough =
          grow_axis(plant, stem[i], direction_at(azimuth + random.between(-0.3, 0.3), angle),
                    length, habit.bough, habit.bare, random);
      add_shoots(plant, bough, length, habit, random);
    }
    azimuth += 0.6;
  }
}

// Places sprays on living twigs, evenly along all of them.
std::vector<Spray> sprays_on(const Skeleton& wood, std::size_t count, const Habit& habit,
                             AssetRandom& random) {
  std::vector<std::size_t> twigs;
  for (std::size_t i = 0; i < wood.size(); ++i) {
    if (wood[i].bears_twigs && wood[i].is_alive) twigs.push_back(i);
  }
  std::vector<Spray> sprays;
  for (std::size_t i = 0; i < count && !twigs.empty(); ++i) {
    const SkeletonNode& node = wood[twigs[i * twigs.size() / count]];
    const glm::dvec3 from = wood[*node.parent].p;
    glm::dvec3 aside = random.direction();
    aside.z *= 1 - habit.flatness;
    const glm::dvec3 along =
        glm::normalize(node.p - from) + habit.spread * aside - glm::dvec3(0, 0, habit.droop);
    const glm::dvec3 sideways =
        glm::mix(random.direction(), glm::cross(along, {0, 0, 1}), habit.flatness);
    sprays.push_back(spray_on(glm::mix(from, node.p, random.between(0, 1)), along,
                              sideways + 1e-6 * random.direction()));
  }
  return sprays;
}

// Widens a stem towards the ground, where its roots begin.
void flare(Skeleton& wood, double height) {
  for (SkeletonNode& node : wood)
    node.radius *= 1 + 0.45 * math::exp(-std::max(node.p.z, 0.0) / (0.03 * height));
}

Skeleton grow_wood(const Habit& habit, double height, AssetRandom& random) {
  Growing plant;
  const double turn = random.angle_rad();
  for (int i = 0; i < habit.stems; ++i) {
    const double out = habit.stems == 1 ? 0 : std::sqrt((i + 0.5) / habit.stems);
    const double azimuth = turn + golden_turn_rad * i;
    const double tall = height * (habit.stems == 1 ? 1 : random.between(0.65, 1) * (1 - 0.2 * out));
    const glm::dvec3 foot = direction_at(azimuth, std::numbers::pi / 2) * (0.06 * height * out);
    const std::size_t root = plant.add(foot - glm::dvec3(0, 0, 0.03 * height), {}, false);
    std::vector<std::size_t> stem =
        grow_axis(plant, root, direction_at(azimuth, habit.stem_lean_rad * out), 1.03 * tall,
                  habit.stem, 1, random);
    plant.is_twig[stem.back()] = 1;
    add_boughs(plant, stem, tall, habit, random);
  }
  thicken(plant.wood, height / (2 * habit.slenderness));
  for (std::size_t i = 0; i < plant.wood.size(); ++i) plant.wood[i].bears_twigs = plant.is_twig[i];
  return std::move(plant.wood);
}

Model finish(Plant& plant, const Habit& habit, AssetShape& shape) {
  plant.height = shape.size_m;
  plant.spray = habit.spray;
  plant.leaf = habit.leaf;
  plant.wood_budget = scaled_count(900, shape.detail);
  constexpr double most_rings = 16;
  plant.coarseness = std::max(std::size_t{1},
                              scaled_count(shape.size_m / habit.stem.step_m, 1 / (2 * most_rings)));
  wither(plant.wood, shape.health, shape.random);
  plant.sprays = sprays_on(plant.wood, spray_count(plant, shape, 540), habit, shape.random);
  return assemble(plant, shape);
}

Model make_tree(const Habit& habit, AssetShape& shape) {
  Plant plant;
  plant.wood = grow_wood(habit, shape.size_m, shape.random);
  if (habit.stems == 1) flare(plant.wood, shape.size_m);
  return finish(plant, habit, shape);
}

// Length of a piece of wood that is natural for a large tree; shorter on small ones.
double step(double natural_m, double height_m) { return std::min(natural_m, height_m / 20); }

Habit pine_habit(double height_m) {
  return {.slenderness = 60,
          .crown = 0.22,
          .clear = 0.5,
          .widest = 0.3,
          .roundness = 0.6,
          .whorl = 5,
          .stem = {.step_m = step(0.42, 1.5 * height_m), .crook = 0.035, .rise = 1.5},
          .bough = {.step_m = step(0.25, height_m), .crook = 0.16, .rise = 0.5},
          .shoot = {.step_m = step(0.18, height_m), .crook = 0.15, .rise = 0.7},
          .low_rad = 1.65,
          .high_rad = 0.75,
          .shoot_share = 0.55,
          .shoot_rad = 0.8,
          .flatness = 0.4,
          .bare = 0.4,
          .spread = 0.5,
          .droop = -0.35,
          .spray = SprayKind::Needles,
          .leaf = {.angles = LeafAngles::AroundTwig,
                   .is_needle = true,
                   .length_m = 0.05,
                   .width = 0.045,
                   .angle_rad = 0.75,
                   .first = 0.25,
                   .per_twig = 60,
                   .twig_m = 0.16,
                   .most = 160'000}};
}

}  // namespace

Model make_spruce(AssetShape shape) {
  const double height_m = shape.size_m;
  return make_tree({.slenderness = 55,
                    .crown = 0.19,
                    .clear = 0.06,
                    .widest = 0.04,
                    .roundness = 0.85,
                    .stem = {.step_m = step(0.1, 0.5 * height_m), .crook = 0.008, .rise = 1},
                    .bough = {.step_m = step(0.17, height_m), .crook = 0.05, .rise = 0.45},
                    .shoot = {.step_m = step(0.2, height_m), .crook = 0.08, .rise = -0.5},
                    .low_rad = 1.95,
                    .high_rad = 0.75,
                    .shoot_share = 0.5,
                    .shoot_rad = 0.95,
                    .flatness = 0.85,
                    .bare = 0.12,
                    .spread = 0.7,
                    .droop = 0.35,
                    .spray = SprayKind::Needles,
                    .leaf = {.angles = LeafAngles::AroundTwig,
                             .is_needle = true,
                             .length_m = 0.018,
                             .width = 0.09,
                             .angle_rad = 0.95,
                             .first = 0,
                             .per_twig = 36,
                             .twig_m = 0.2,
                             .sag = 0.25,
                             .most = 200'000}},
                   shape);
}

Model make_pine(AssetShape shape) { return make_tree(pine_habit(shape.size_m), shape); }

Model make_birch(AssetShape shape) {
  const double height_m = shape.size_m;
  return make_tree({.slenderness = 75,
                    .crown = 0.24,
                    .clear = 0.25,
                    .widest = 0.3,
                    .roundness = 0.75,
                    .stem = {.step_m = step(0.14, height_m), .crook = 0.04, .rise = 1.5},
                    .bough = {.step_m = step(0.22, height_m), .crook = 0.14, .rise = -0.35},
                    .shoot = {.step_m = step(0.16, height_m), .crook = 0.1, .rise = -2.2},
                    .low_rad = 1.0,
                    .high_rad = 0.4,
                    .shoot_share = 0.6,
                    .shoot_rad = 0.7,
                    .flatness = 0.2,
                    .bare = 0.25,
                    .spread = 0.5,
                    .droop = 0.9,
                    .leaf = {.angles = LeafAngles::Plagiophile,
                             .length_m = 0.05,
                             .width = 0.75,
                             .per_twig = 10,
                             .twig_m = 0.3,
                             .sag = 0.35,
                             .most = 50'000}},
                   shape);
}

Model make_oak(AssetShape shape) {
  AssetRandom& random = shape.random;
  const double height = shape.size_m;
  const double fork = height * random.between(0.2, 0.26);
  const CrownShape crown{
      .center = glm::dvec3(0, 0, 0.6) * height,
      .half = glm::dvec3{random.between(0.42, 0.48), random.between(0.42, 0.48), 0.4} * height,
      .points = 700,
      .step = 0.026 * height,
      .sight = 0.45 * height,
      .reach = 0.042 * height,
      .lowest = 0.26 * height};
  Growing foot;
  const std::size_t root = foot.add({0, 0, -0.03 * height}, {}, false);
  grow_axis(foot, root, {0, 0, 1}, fork + 0.03 * height, {.step_m = 0.04 * height, .crook = 0.08},
            1, random);
  Plant plant;
  plant.wood = std::move(foot.wood);
  colonise(plant.wood, crown, random);
  for (SkeletonNode& node : plant.wood) {
    if (node.p.z > fork) node.p += 0.009 * height * random.direction();  // crooked limbs
  }
  thicken(plant.wood, height / (2 * 30));
  flare(plant.wood, height);
  for (SkeletonNode& node : plant.wood) node.bears_twigs = node.parent && node.tips <= 4;
  return finish(plant,
                {.stem = {.step_m = crown.step},
                 .spread = 1.1,
                 .leaf = {.angles = LeafAngles::Planophile,
                          .length_m = 0.1,
                          .width = 0.55,
                          .per_twig = 12,
                          .twig_m = 0.25,
                          .most = 50'000}},
                shape);
}

Model make_bush(AssetShape shape) {
  const double height_m = shape.size_m;
  return make_tree({.stems = 14,
                    .stem_lean_rad = 0.75,
                    .slenderness = 90,
                    .crown = 0.2,
                    .clear = 0.2,
                    .widest = 0.5,
                    .roundness = 0.6,
                    .stem = {.step_m = step(0.15, 2 * height_m), .crook = 0.1, .rise = -0.15},
                    .bough = {.step_m = step(0.15, height_m), .crook = 0.15, .rise = 0.2},
                    .shoot = {.step_m = step(0.12, height_m), .crook = 0.15, .rise = 0.1},
                    .low_rad = 0.9,
                    .high_rad = 0.5,
                    .shoot_share = 0.5,
                    .shoot_rad = 0.8,
                    .bare = 0.2,
                    .spread = 0.9,
                    .leaf = {.angles = LeafAngles::Plagiophile,
                             .length_m = 0.06,
                             .width = 0.6,
                             .per_twig = 9,
                             .twig_m = 0.15,
                             .most = 30'000}},
                   shape);
}

// A dead pine without fine twigs. Its top and most of its boughs are broken off.
Model make_snag(AssetShape shape) {
  const double whole_m = shape.size_m / shape.random.between(0.6, 0.85);
  Habit habit = pine_habit(whole_m);
  habit.clear = 0.3;
  Plant plant;
  plant.wood = grow_wood(habit, whole_m, shape.random);
  flare(plant.wood, whole_m);
  shape.health = 0;
  shape.leaves = LeafModel::Geometry;
  break_off(plant.wood, shape.size_m, shape.random);
  return finish(plant, habit, shape);
}

}  // namespace groundray
