// Assembly of a plant: wood as closed tapered tubes, sprays as cards with an image or as twigs with
// leaves. The size of cards or leaves gives the crown the requested leaf area index.
#include "terrain/assets/asset_plant.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numbers>
#include <optional>
#include <utility>

#include "core/math.h"
#include "terrain/assets/asset_leaf_mesh.h"

namespace groundray {
namespace {

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
void add_coarse_wood(AssetBuilder& builder, const Plant& plant, std::uint16_t bark) {
  const std::vector<Chain> chains = chains_of(plant.wood);
  const double thickest = chains.front().front().radius;
  std::size_t used = 0;
  for (const Chain& chain : chains) {
    const double share = chain.front().radius / thickest;
    const int sides = share > 0.6 ? 8 : share > 0.3 ? 5 : 3;
    const Chain rings = thinned(chain, plant.coarseness * (share > 0.3 ? 2 : 3));
    const std::size_t k = static_cast<std::size_t>(sides);
    used += (rings.size() - 2) * 2 * k + k + k - 2;
    if (used > plant.wood_budget) return;
    builder.add_tube(rings, sides, bark);
  }
}

// Adds all branches.
void add_fine_wood(AssetBuilder& builder, const Skeleton& wood, double detail, std::uint16_t bark) {
  const std::vector<Chain> chains = chains_of(wood);
  const double thickest = chains.front().front().radius;
  const double finer = std::clamp(std::sqrt(detail), 0.7, 2.5);
  for (const Chain& chain : chains) {
    const double share = chain.front().radius / thickest;
    const double sides = share > 0.6 ? 12 : share > 0.2 ? 7 : share > 0.08 ? 4 : 3;
    builder.add_tube(chain, std::max(3, static_cast<int>(std::lround(sides * finer))), bark);
  }
}

void corners_of(const Spray& card, double size, std::array<glm::dvec3, 4>& corners) {
  const glm::dvec3 half = card.side * (size / 2), up = card.along * size;
  corners = {card.base - half, card.base + half, card.base + half + up, card.base - half + up};
}

double crown_area(const std::vector<Spray>& cards, double size) {
  std::vector<glm::dvec2> plan;
  std::array<glm::dvec3, 4> corners;
  for (const Spray& card : cards) {
    corners_of(card, size, corners);
    for (const glm::dvec3& p : corners) plan.emplace_back(p);
  }
  return hull_area(std::move(plan));
}

// Returns the side of the cards that gives the requested leaf area index. The crown's area grows
// with the cards, but more slowly, so the iteration converges.
double card_size(const std::vector<Spray>& cards, double share, double leaf_area_index) {
  double size = 0;
  for (int i = 0; i < 60; ++i) {
    const double leaf = leaf_area_index * crown_area(cards, size);
    const double next = std::sqrt(leaf / (share * static_cast<double>(cards.size())));
    if (std::abs(next - size) <= 1e-12 * next) break;
    size = next;
  }
  return size;
}

void add_cards(AssetBuilder& builder, const std::vector<Spray>& cards, double leaf_area_index,
               SprayKind kind) {
  constexpr std::array<glm::dvec2, 4> uv{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  const std::uint16_t leaf = builder.add_surface(spray_surface(kind));
  const double share = opaque_share(builder.model().surfaces[leaf].albedo.pixels);
  const double size = card_size(cards, share, leaf_area_index);
  std::array<glm::dvec3, 4> corners;
  std::array<std::uint32_t, 4> number{};
  for (const Spray& card : cards) {
    corners_of(card, size, corners);
    const glm::dvec3 normal = glm::cross(card.side, card.along);
    for (std::size_t i = 0; i < 4; ++i) number[i] = builder.add_vertex(corners[i], normal, uv[i]);
    builder.add_triangle(number[0], number[1], number[2], leaf);
    builder.add_triangle(number[0], number[2], number[3], leaf);
  }
}

}  // namespace

Spray spray_on(const glm::dvec3& base, const glm::dvec3& along, const glm::dvec3& sideways) {
  const glm::dvec3 unit = glm::normalize(along);
  return {base, unit, glm::normalize(sideways - unit * glm::dot(sideways, unit))};
}

std::size_t scaled_count(double usual, double detail) {
  return static_cast<std::size_t>(std::lround(usual * detail));
}

std::size_t spray_count(const Plant& plant, const AssetShape& shape, double usual) {
  if (shape.leaves == LeafModel::Cards) return scaled_count(usual * shape.health, shape.detail);
  std::vector<glm::dvec2> plan;
  for (const SkeletonNode& node : plant.wood) plan.emplace_back(node.p);
  const double metre = plant.height / shape.size_m;
  const double crown_m2 = hull_area(std::move(plan)) / (metre * metre);
  const double leaf_m2 = unit_leaf_area(plant.leaf) * plant.leaf.length_m * plant.leaf.length_m;
  const double leaves = std::min(shape.leaf_area_index * crown_m2 / leaf_m2,
                                 static_cast<double>(plant.leaf.most) * shape.detail);
  return scaled_count(std::max(60.0, leaves / plant.leaf.per_twig), shape.health);
}

Model assemble(const Plant& plant, AssetShape& shape) {
  AssetBuilder builder;
  const std::uint16_t bark =
      builder.add_surface(asset_surface(shape.health == 0 ? "wood" : "bark"));
  const double index = shape.leaf_area_index * shape.health;
  if (shape.leaves == LeafModel::Cards) {
    add_coarse_wood(builder, plant, bark);
    if (!plant.sprays.empty()) add_cards(builder, plant.sprays, index, plant.spray);
  } else {
    add_fine_wood(builder, plant.wood, shape.detail, bark);
    if (!plant.sprays.empty()) {
      const double metre = plant.height / shape.size_m;
      add_twigs(builder, plant.sprays,
                {.leaf = plant.leaf,
                 .twig_length = std::min(plant.leaf.twig_m * metre, 0.1 * plant.height),
                 .twig_radius = 0.0015 * metre,
                 .leaf_area_index = index,
                 .material = plant.spray == SprayKind::Leaves ? "broad_leaf" : "leaf",
                 .bark = bark},
                shape.random);
    }
  }
  double top = 0;
  for (const glm::dvec3& p : builder.model().mesh.vertices_m) top = std::max(top, p.z);
  builder.scale(shape.size_m / top);
  return builder.take();
}

}  // namespace groundray
