// Leaves as geometry: ovate leaves folded along the midrib and bent, or needles.
#include "terrain/assets/asset_leaf_mesh.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <utility>
#include <vector>

#include "core/math.h"

namespace groundray {
namespace {

// Shape of a leaf of length 1: x along it, y to its side, z along its normal.
struct LeafOutline {
  std::vector<glm::dvec3> vertices;
  std::vector<glm::uvec3> triangles;
};

LeafOutline outline_of(const LeafForm& leaf) {
  const double half = leaf.width / 2;
  if (leaf.is_needle) return {{{0, -half, 0}, {0, half, 0}, {1, 0, 0}}, {{0, 1, 2}}};
  const double fold = 0.3 * half;
  return {{{0, 0, 0},
           {0.3, -half, fold},
           {0.7, -0.8 * half, fold},
           {1, 0, -0.05},
           {0.7, 0.8 * half, fold},
           {0.3, half, fold}},
          {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}};
}

// A leaf of the plant, with the length `scale` times the common length.
struct PlacedLeaf {
  glm::dvec3 stalk, along, normal;
  double scale = 1;

  glm::dvec3 at(const glm::dvec3& p, double length) const {
    const glm::dvec3 side = glm::cross(normal, along);
    return stalk + (along * p.x + side * p.y + normal * p.z) * (length * scale);
  }
};

double density(LeafAngles angles, double x) {
  switch (angles) {
    case LeafAngles::Planophile:
      return (1 + math::cos(2 * x)) / 2;
    case LeafAngles::Plagiophile:
      return (1 - math::cos(4 * x)) / 2;
    default:
      return math::sin(x);
  }
}

// Returns a normal that points upward, with an inclination of the given distribution.
glm::dvec3 leaf_normal(LeafAngles angles, AssetRandom& random) {
  double x = 0;
  do {
    x = random.between(0, std::numbers::pi / 2);
  } while (random.between(0, 1) > density(angles, x));
  const double azimuth = random.angle_rad();
  return {math::sin(x) * math::cos(azimuth), math::sin(x) * math::sin(azimuth), math::cos(x)};
}

// Returns the unit vector closest to `v` that is perpendicular to the unit vector `to`.
glm::dvec3 perpendicular(const glm::dvec3& v, const glm::dvec3& to) {
  return glm::normalize(v - to * glm::dot(v, to));
}

glm::dvec3 place_on(const Spray& spray, const TwigStyle& style, double s) {
  const double flat = style.twig_length * s;
  return spray.base + spray.along * flat - glm::dvec3(0, 0, style.leaf.sag * flat * s);
}

std::vector<PlacedLeaf> leaves_on(std::span<const Spray> sprays, const TwigStyle& style,
                                  AssetRandom& random) {
  const LeafForm& form = style.leaf;
  std::vector<PlacedLeaf> leaves;
  for (const Spray& spray : sprays) {
    const glm::dvec3 up = glm::cross(spray.along, spray.side);
    for (int i = 0; i < form.per_twig; ++i) {
      const bool is_last = i + 1 == form.per_twig;
      const double s = form.first + (1 - form.first) * (i + 0.5) / form.per_twig;
      // Leaves of a needle twig stand all around it, others in two rows and one at the tip.
      const double around = form.is_needle ? random.angle_rad() : std::numbers::pi * i;
      const double away = is_last ? 0.1 : form.angle_rad * random.between(0.75, 1.25);
      const glm::dvec3 outward = spray.side * math::cos(around) + up * math::sin(around);
      const glm::dvec3 twig = spray.along - glm::dvec3(0, 0, 2 * form.sag * s);
      const glm::dvec3 along =
          glm::normalize(glm::normalize(twig) * math::cos(away) + outward * math::sin(away));
      PlacedLeaf leaf{place_on(spray, style, is_last ? 1 : s), along, {}, 1};
      leaf.scale = random.between(0.75, 1.25);
      if (form.angles == LeafAngles::AroundTwig) {
        leaf.normal = perpendicular(random.direction(), along);
      } else {
        leaf.normal = leaf_normal(form.angles, random);
        leaf.along = perpendicular(along + 1e-6 * spray.side, leaf.normal);
      }
      leaves.push_back(leaf);
    }
  }
  return leaves;
}

// Returns the length of the leaves that gives the requested leaf area index. The area of the crown
// depends on it only slightly, so the iteration converges.
double leaf_length(const std::vector<PlacedLeaf>& leaves, const LeafOutline& outline, double area,
                   double leaf_area_index) {
  double squares = 0, length = 0;
  for (const PlacedLeaf& leaf : leaves) squares += leaf.scale * leaf.scale;
  for (int i = 0; i < 60; ++i) {
    std::vector<glm::dvec2> plan;
    plan.reserve(leaves.size() * outline.vertices.size());
    for (const PlacedLeaf& leaf : leaves) {
      for (const glm::dvec3& p : outline.vertices) plan.emplace_back(leaf.at(p, length));
    }
    const double next = std::sqrt(leaf_area_index * hull_area(std::move(plan)) / (area * squares));
    if (std::abs(next - length) <= 1e-11 * next) break;
    length = next;
  }
  return length;
}

}  // namespace

double unit_leaf_area(const LeafForm& leaf) {
  const LeafOutline outline = outline_of(leaf);
  double area = 0;
  for (const glm::uvec3& t : outline.triangles) {
    const auto& p = outline.vertices;
    area += glm::length(glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x])) / 2;
  }
  return area;
}

void add_twigs(AssetBuilder& builder, std::span<const Spray> sprays, const TwigStyle& style,
               AssetRandom& random) {
  constexpr int sides = 3;
  std::vector<TubeRing> rings;
  for (const Spray& spray : sprays) {
    rings.clear();
    const int pieces = style.leaf.sag > 0 ? 2 : 1;
    for (int i = 0; i <= pieces; ++i) {
      const double s = static_cast<double>(i) / pieces;
      rings.push_back({place_on(spray, style, s), style.twig_radius * (1 - s)});
    }
    builder.add_tube(rings, sides, style.bark);
  }
  const LeafOutline outline = outline_of(style.leaf);
  const std::vector<PlacedLeaf> leaves = leaves_on(sprays, style, random);
  const double length =
      leaf_length(leaves, outline, unit_leaf_area(style.leaf), style.leaf_area_index);
  const std::uint16_t surface = builder.add_surface(asset_surface(style.material));
  for (const PlacedLeaf& leaf : leaves) {
    const auto first = static_cast<std::uint32_t>(builder.model().mesh.vertices_m.size());
    for (const glm::dvec3& p : outline.vertices) {
      builder.add_vertex(leaf.at(p, length), leaf.normal,
                         {0.5 + p.y / (2 * style.leaf.width), p.x});
    }
    for (const glm::uvec3& t : outline.triangles)
      builder.add_triangle(first + t.x, first + t.y, first + t.z, surface);
  }
}

}  // namespace groundray
