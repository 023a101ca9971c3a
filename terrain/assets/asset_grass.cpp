// Tufts and patches of grass: blades that taper, lean outward and bend towards their tips.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>

#include "core/math.h"
#include "terrain/assets/asset_blade.h"
#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_kinds.h"

namespace groundray {
namespace {

// Dimensions of blades, as fractions of the tuft's height.
constexpr double root_spread = 0.09, root_depth = 0.03, widest = 0.012;
constexpr int segment_count = 3;

// Half width of a blade at the foot of each segment; 0 at the tip.
constexpr std::array<double, segment_count> blade_half_width{0.8, 1.0, 0.65};

Blade tuft_blade(AssetRandom& random) {
  const double towards = random.angle_rad();
  const double away = root_spread * std::sqrt(random.between(0, 1));
  Blade blade;
  blade.foot = {away * math::cos(towards), away * math::sin(towards), -root_depth};
  blade.azimuth = towards + 0.5 * random.normal();
  blade.length = random.between(0.45, 1.05);
  blade.width = widest * random.between(0.6, 1);
  blade.lean = random.between(0.03, 0.45);
  blade.bend = random.between(0.1, 1.1);
  blade.twist = 0.5 * random.normal();
  return blade;
}

// Adds a stalk with a spike of seeds, as long as a fifth of it.
void add_seed_head(AssetBuilder& builder, const Blade& stalk, AssetRandom& random,
                   std::uint16_t surface) {
  const glm::dvec3 tip = add_blade(builder, stalk, surface);
  constexpr int spikelets = 9;
  for (int i = 0; i < spikelets; ++i) {
    const double along = 0.2 * stalk.length * (i + 0.5) / spikelets;
    const glm::dvec3 from = tip - glm::dvec3(0, 0, along);
    const glm::dvec3 out = glm::normalize(random.direction() + glm::dvec3(0, 0, 2.2));
    const glm::dvec3 side = glm::normalize(glm::cross(out, random.direction()));
    add_leaflet(builder, from, from + 0.05 * stalk.length * out, 0.006 * stalk.length * side,
                surface);
  }
}

}  // namespace

glm::dvec3 add_blade(AssetBuilder& builder, const Blade& blade, std::uint16_t surface) {
  const double azimuth = blade.azimuth;
  const glm::dvec3 outward{math::cos(azimuth), math::sin(azimuth), 0};
  const glm::dvec3 across{-math::sin(azimuth), math::cos(azimuth), 0};
  glm::dvec3 p = blade.foot;
  std::array<std::uint32_t, std::size_t{2} * segment_count> pair{};
  for (std::size_t i = 0;; ++i) {
    const double s = static_cast<double>(i) / segment_count;
    const double tilt = blade.lean + blade.bend * s * s;  // angle from the vertical, rad
    const glm::dvec3 along{math::sin(tilt) * outward.x, math::sin(tilt) * outward.y,
                           math::cos(tilt)};
    const glm::dvec3 face = glm::cross(across, along);
    const glm::dvec3 side = across * math::cos(blade.twist * s) + face * math::sin(blade.twist * s);
    const glm::dvec3 normal = glm::normalize(glm::cross(along, side));
    if (i == segment_count) {
      const std::uint32_t tip = builder.add_vertex(p, normal, {0.5, 1});
      builder.add_triangle(pair[2 * i - 2], pair[2 * i - 1], tip, surface);
      return p;
    }
    const glm::dvec3 half = side * (blade.width / 2 * blade_half_width[i]);
    pair[2 * i] = builder.add_vertex(p - half, normal, {0, s});
    pair[2 * i + 1] = builder.add_vertex(p + half, normal, {1, s});
    if (i > 0) {
      builder.add_triangle(pair[2 * i - 2], pair[2 * i - 1], pair[2 * i + 1], surface);
      builder.add_triangle(pair[2 * i - 2], pair[2 * i + 1], pair[2 * i], surface);
    }
    p += along * (blade.length / segment_count);
  }
}

void add_leaflet(AssetBuilder& builder, const glm::dvec3& from, const glm::dvec3& to,
                 const glm::dvec3& side, std::uint16_t surface) {
  const glm::dvec3 normal = glm::normalize(glm::cross(to - from, side));
  const glm::dvec3 widest_at =
      glm::mix(from, to, 0.35) + normal * (0.3 * glm::length(side));  // folded
  const std::uint32_t a = builder.add_vertex(from, normal, {0.5, 0});
  const std::uint32_t b = builder.add_vertex(widest_at - side, normal, {0, 0.35});
  const std::uint32_t c = builder.add_vertex(to, normal, {0.5, 1});
  const std::uint32_t d = builder.add_vertex(widest_at + side, normal, {1, 0.35});
  builder.add_triangle(a, b, c, surface);
  builder.add_triangle(a, c, d, surface);
}

void scale_to_height(AssetBuilder& builder, double height_m) {
  double top = 0;
  for (const glm::dvec3& p : builder.model().mesh.vertices_m) top = std::max(top, p.z);
  builder.scale(height_m / top);
}

Model make_grass_tuft(AssetShape shape) {
  AssetBuilder builder;
  const std::uint16_t surface = builder.add_surface(asset_surface("dry_grass"));
  const int blades = std::max(3, static_cast<int>(std::lround(40 * shape.detail)));
  for (int i = 0; i < blades; ++i) add_blade(builder, tuft_blade(shape.random), surface);
  scale_to_height(builder, shape.size_m);
  return builder.take();
}

// Blades grow in tussocks. Some are dead; some are stalks with seeds, which stand highest.
Model make_grass_patch(AssetShape shape) {
  constexpr double seed_share = 0.06, dead_share = 0.2, tussock_m = 0.05, blades_per_tussock = 18;
  AssetRandom& random = shape.random;
  AssetBuilder builder;
  const std::uint16_t green = builder.add_surface(asset_surface("broad_leaf"));
  const std::uint16_t dry = builder.add_surface(asset_surface("dry_grass"));
  const double half = shape.width_m / 2, height = shape.size_m;
  const int blades = std::max(3, static_cast<int>(std::lround(shape.per_m2 * shape.width_m *
                                                              shape.width_m * shape.detail)));
  // Fewer blades are wider.
  const double wider = 1 / std::sqrt(shape.detail);
  glm::dvec3 tussock{0};
  double vigour = 1;
  for (int i = 0; i < blades; ++i) {
    if (random.between(0, blades_per_tussock) < 1 || i == 0) {
      tussock = {random.between(-half, half), random.between(-half, half), -root_depth * height};
      vigour = random.between(0.55, 1);
    }
    Blade blade;
    blade.foot = tussock + glm::dvec3{random.normal(), random.normal(), 0} * tussock_m;
    blade.foot.x = std::clamp(blade.foot.x, -half, half);
    blade.foot.y = std::clamp(blade.foot.y, -half, half);
    blade.azimuth = random.angle_rad();
    blade.twist = 0.6 * random.normal();
    const double kind = random.between(0, 1);
    if (kind < seed_share) {
      blade.length = height * random.between(0.85, 1.1);
      blade.width = 0.002 * wider;
      blade.lean = random.between(0, 0.2);
      blade.bend = random.between(0, 0.3);
      add_seed_head(builder, blade, random, dry);
      continue;
    }
    blade.length = height * vigour * random.between(0.4, 1);
    blade.width = random.between(0.003, 0.006) * wider;
    blade.lean = random.between(0.05, 0.6);
    blade.bend = random.between(0.2, 1.5);
    add_blade(builder, blade, kind < seed_share + dead_share ? dry : green);
  }
  scale_to_height(builder, shape.size_m);
  return builder.take();
}

}  // namespace groundray
