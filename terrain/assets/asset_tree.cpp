// Shrubs and trees: wood as closed tapered tubes, leaves as cards with the image of a spray. The
// size of the cards gives the crown the requested leaf area index.
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
#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_kinds.h"
#include "terrain/assets/asset_skeleton.h"

namespace groundray {
namespace {

// Foliage card: a square that extends from `base` in the direction of `along`.
struct Card {
  glm::dvec3 base;
  glm::dvec3 along;  // unit
  glm::dvec3 side;   // unit, perpendicular to `along`
};

using Chain = std::vector<TubeRing>;

// Returns the stems and branches. Each continues in its thickest child; all other children begin
// branches that start inside it.
std::vector<Chain> chains_of(const Skeleton& wood) {
  std::vector<std::size_t> heir(wood.size(), 0);  // 0: none, since no child has index 0
  for (std::size_t i = 0; i < wood.size(); ++i) {
    if (!wood[i].parent) continue;
    std::size_t& best = heir[*wood[i].parent];
    if (best == 0 || wood[i].tips > wood[best].tips) best = i;
  }
  std::vector<Chain> chains;
  for (std::size_t i = 0; i < wood.size(); ++i) {
    if (wood[i].parent && heir[*wood[i].parent] == i) continue;
    Chain chain;
    if (wood[i].parent) chain.push_back({wood[*wood[i].parent].p, wood[i].radius});
    for (std::size_t at = i; at != 0 || chain.empty(); at = heir[at]) {
      chain.push_back({wood[at].p, wood[at].radius});
      if (heir[at] == 0) break;
    }
    if (chain.size() < 2) continue;
    chain.back().radius = 0;
    chains.push_back(std::move(chain));
  }
  std::ranges::stable_sort(chains, std::ranges::greater{},
                           [](const Chain& chain) { return chain.front().radius; });
  return chains;
}

// Keeps every n-th ring and both ends.
Chain thinned(const Chain& chain, std::size_t n) {
  Chain rings;
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
    if (i % n == 0) rings.push_back(chain[i]);
  }
  rings.push_back(chain.back());
  return rings;
}

// Adds the thickest branches that the triangle budget allows. Thinner twigs appear only in the
// images of the cards.
void add_wood(AssetBuilder& builder, const Skeleton& wood, std::size_t budget, std::uint16_t bark) {
  const std::vector<Chain> chains = chains_of(wood);
  const double thickest = chains.front().front().radius;
  std::size_t used = 0;
  for (const Chain& chain : chains) {
    const double share = chain.front().radius / thickest;
    const int sides = share > 0.6 ? 8 : share > 0.3 ? 5 : 3;
    const Chain rings = thinned(chain, share > 0.3 ? 2 : 3);
    const std::size_t k = static_cast<std::size_t>(sides);
    used += (rings.size() - 2) * 2 * k + k + k - 2;
    if (used > budget) return;
    builder.add_tube(rings, sides, bark);
  }
}

void corners_of(const Card& card, double size, std::array<glm::dvec3, 4>& corners) {
  const glm::dvec3 half = card.side * (size / 2), up = card.along * size;
  corners = {card.base - half, card.base + half, card.base + half + up, card.base - half + up};
}

double crown_area(const std::vector<Card>& cards, double size) {
  std::vector<glm::dvec2> plan;
  std::array<glm::dvec3, 4> corners;
  for (const Card& card : cards) {
    corners_of(card, size, corners);
    for (const glm::dvec3& p : corners) plan.emplace_back(p);
  }
  return hull_area(std::move(plan));
}

// Returns the side of the cards that gives the requested leaf area index. The crown's area grows
// with the cards, but more slowly, so the iteration converges.
double card_size(const std::vector<Card>& cards, double share, double leaf_area_index) {
  double size = 0;
  for (int i = 0; i < 60; ++i) {
    const double leaf = leaf_area_index * crown_area(cards, size);
    const double next = std::sqrt(leaf / (share * static_cast<double>(cards.size())));
    if (std::abs(next - size) <= 1e-12 * next) break;
    size = next;
  }
  return size;
}

void add_cards(AssetBuilder& builder, const std::vector<Card>& cards, double size,
               std::uint16_t leaf) {
  constexpr std::array<glm::dvec2, 4> uv{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  std::array<glm::dvec3, 4> corners;
  std::array<std::uint32_t, 4> number{};
  for (const Card& card : cards) {
    corners_of(card, size, corners);
    const glm::dvec3 normal = glm::cross(card.side, card.along);
    for (std::size_t i = 0; i < 4; ++i) number[i] = builder.add_vertex(corners[i], normal, uv[i]);
    builder.add_triangle(number[0], number[1], number[2], leaf);
    builder.add_triangle(number[0], number[2], number[3], leaf);
  }
}

// Parts of a plant, in an arbitrary unit of length.
struct Plant {
  Skeleton wood;
  std::vector<Card> cards;
  SprayKind spray = SprayKind::Leaves;
  std::size_t wood_budget = 0;  // triangles
};

Model put_together(const Plant& plant, double height_m, double leaf_area_index) {
  AssetBuilder builder;
  const std::uint16_t bark = builder.add_surface(asset_surface("bark"));
  const std::uint16_t leaf = builder.add_surface(spray_surface(plant.spray));
  add_wood(builder, plant.wood, plant.wood_budget, bark);
  const double share = opaque_share(builder.model().surfaces[leaf].albedo.pixels);
  add_cards(builder, plant.cards, card_size(plant.cards, share, leaf_area_index), leaf);
  double top = 0;
  for (const glm::dvec3& p : builder.model().mesh.vertices_m) top = std::max(top, p.z);
  builder.scale(height_m / top);
  return builder.take();
}

Card card_on(const glm::dvec3& base, const glm::dvec3& along, const glm::dvec3& sideways) {
  const glm::dvec3 unit = glm::normalize(along);
  return {base, unit, glm::normalize(sideways - unit * glm::dot(sideways, unit))};
}

// Places cards on twigs, in all directions but preferably outward and along the twig.
std::vector<Card> scatter_cards(const Skeleton& wood, const glm::dvec3& center, std::size_t count,
                                AssetRandom& random) {
  std::vector<std::size_t> twigs;
  for (std::size_t i = 0; i < wood.size(); ++i) {
    if (wood[i].parent && wood[i].tips <= 3) twigs.push_back(i);
  }
  std::vector<Card> cards;
  for (std::size_t i = 0; i < count; ++i) {
    const SkeletonNode& node = wood[twigs[i * twigs.size() / count]];
    const glm::dvec3 from = wood[*node.parent].p;
    const glm::dvec3 base = glm::mix(from, node.p, random.between(0, 1));
    const glm::dvec3 along = glm::normalize(node.p - from) + 0.6 * glm::normalize(base - center) +
                             0.9 * random.direction();
    cards.push_back(card_on(base, along, random.direction()));
  }
  return cards;
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

std::size_t scaled_count(double usual, double detail) {
  return static_cast<std::size_t>(std::lround(usual * detail));
}

// Makes goals more numerous and, in proportion, closer together.
void refine(CrownShape& crown, double detail) {
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
  refine(crown, shape.detail);
  add_stem(plant.wood, {0, 0, -0.03}, fork, 0.05, random);
  colonise(plant.wood, crown, random);
  thicken(plant.wood, 0.5 / 45);  // height / diameter = 45: stable below 80 (Wonn, O'Hara, 2001)
  plant.wood_budget = scaled_count(900, shape.detail);
  plant.cards = scatter_cards(plant.wood, crown.center, scaled_count(540, shape.detail), random);
  return put_together(plant, shape.size_m, shape.leaf_area_index);
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
  refine(crown, shape.detail);
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
  plant.wood_budget = scaled_count(800, shape.detail);
  plant.cards = scatter_cards(plant.wood, {0, 0, 0.2}, scaled_count(480, shape.detail), random);
  return put_together(plant, shape.size_m, shape.leaf_area_index);
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
std::vector<Card> cards_on(const std::vector<Bough>& boughs, std::size_t count,
                           AssetRandom& random) {
  // Cumulative lengths of the boughs. The cards are evenly spaced along all of them.
  std::vector<double> ends;
  for (const Bough& bough : boughs) ends.push_back((ends.empty() ? 0 : ends.back()) + bough.length);
  std::vector<Card> cards;
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
    cards.push_back(card_on(base, along, side));
  }
  return cards;
}

}  // namespace

Model make_conifer(AssetShape shape) {
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
  plant.cards = cards_on(boughs, scaled_count(540, shape.detail), shape.random);
  return put_together(plant, shape.size_m, shape.leaf_area_index);
}

}  // namespace groundray
