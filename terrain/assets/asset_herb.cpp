// Ferns and reeds.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>

#include "core/math.h"
#include "terrain/assets/asset_blade.h"
#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_kinds.h"

namespace groundray {
namespace {

// Rib of a fern's frond: it rises from the rootstock and arches outward.
struct Rib {
  glm::dvec3 foot, outward;
  double length = 1, lean = 0.3, arch = 1;

  glm::dvec3 direction(double s) const {  // s from 0 to 1
    const double tilt = lean + arch * s * s;
    return outward * math::sin(tilt) + glm::dvec3(0, 0, math::cos(tilt));
  }
};

// Adds a frond: the rib as a narrow sheet, and leaflets in pairs, longest at a third of it.
void add_frond(AssetBuilder& builder, const Rib& rib, int pairs, AssetRandom& random,
               std::uint16_t surface) {
  constexpr double bare = 0.18, rib_width = 0.008;
  const glm::dvec3 left = glm::cross(glm::dvec3(0, 0, 1), rib.outward);
  glm::dvec3 p = rib.foot;
  const double piece = 1.0 / pairs;
  std::uint32_t before = 0;
  for (int i = 0; i <= pairs; ++i) {
    const double s = i * piece;
    const glm::dvec3 along = rib.direction(s);
    const glm::dvec3 face = glm::cross(along, left);
    const glm::dvec3 half = left * (rib.length * rib_width / 2 * (1.05 - s));
    const std::uint32_t now = builder.add_vertex(p - half, face, {0, s});
    builder.add_vertex(p + half, face, {1, s});
    if (i > 0) {
      builder.add_triangle(before, now, now + 1, surface);
      builder.add_triangle(before, now + 1, before + 1, surface);
    }
    before = now;
    const double t = (s - bare) / (1 - bare);
    if (t > 0) {
      const double reach =
          0.2 * rib.length * (t < 0.3 ? 0.55 + 1.5 * t : 1.02 * (1 - t) / 0.7 + 0.02);
      for (const double sign : {-1.0, 1.0}) {
        const glm::dvec3 out = glm::normalize(left * sign + along * random.between(0.2, 0.45) +
                                              face * random.between(-0.25, 0.1));
        const double width = 0.62 * rib.length * piece;
        const glm::dvec3 side = glm::normalize(glm::cross(face, out)) * (width / 2);
        add_leaflet(builder, p, p + out * (reach * random.between(0.9, 1.1)), side, surface);
      }
    }
    p += along * (rib.length * piece);
  }
}

}  // namespace

Model make_fern(AssetShape shape) {
  AssetBuilder builder;
  AssetRandom& random = shape.random;
  const std::uint16_t surface = builder.add_surface(asset_surface("broad_leaf"));
  const int fronds = 11, pairs = std::max(6, static_cast<int>(std::lround(26 * shape.detail)));
  for (int i = 0; i < fronds; ++i) {
    const double azimuth = 2.399963229728653 * i + random.between(-0.3, 0.3);
    const glm::dvec3 outward{math::cos(azimuth), math::sin(azimuth), 0};
    const double age = (i + 0.5) / fronds;  // outer fronds are older and lower
    add_frond(builder,
              {.foot = outward * 0.03 - glm::dvec3(0, 0, 0.03),
               .outward = outward,
               .length = random.between(0.85, 1.2),
               .lean = 0.1 + 0.55 * age,
               .arch = random.between(0.7, 1.3)},
              pairs, random, surface);
  }
  scale_to_height(builder, shape.size_m);
  return builder.take();
}

// Stems with arching leaves in two rows, and a drooping panicle on most of them. Leaves are 20 to
// 50 cm long and 2 to 3 cm wide on a reed of 2 to 6 m.
Model make_reed(AssetShape shape) {
  constexpr double leaf_width = 0.06;  // of its length
  AssetRandom& random = shape.random;
  AssetBuilder builder;
  const std::uint16_t green = builder.add_surface(asset_surface("broad_leaf"));
  const std::uint16_t dry = builder.add_surface(asset_surface("dry_grass"));
  const double half = shape.width_m / 2;
  const int stems =
      std::max(2, static_cast<int>(std::lround(shape.per_m2 * shape.width_m * shape.width_m)));
  for (int i = 0; i < stems; ++i) {
    const double height = shape.size_m * random.between(0.7, 1);
    Blade stem{
        .foot = {random.between(-half, half), random.between(-half, half), -0.03 * shape.size_m},
        .azimuth = random.angle_rad(),
        .length = 0.85 * height,
        .width = 0.0035 * height,
        .lean = random.between(0, 0.1),
        .bend = random.between(0, 0.25)};
    const glm::dvec3 tip = add_blade(builder, stem, dry);
    stem.twist = std::numbers::pi / 2;  // a second sheet across the first
    add_blade(builder, stem, dry);
    const int leaves = std::max(3, static_cast<int>(std::lround(9 * shape.detail)));
    const double rows = random.angle_rad();
    for (int k = 0; k < leaves; ++k) {
      const double s = 0.2 + 0.78 * (k + random.between(0, 0.8)) / leaves;
      const double length = height * random.between(0.13, 0.22);
      add_blade(builder,
                {.foot = glm::mix(stem.foot, tip, s),
                 .azimuth = rows + std::numbers::pi * k + random.between(-0.5, 0.5),
                 .length = length,
                 .width = leaf_width * length,
                 .lean = random.between(0.3, 0.7),
                 .bend = random.between(0.4, 1.6),
                 .twist = 0.3 * random.normal()},
                green);
    }
    if (random.between(0, 1) < 0.25) continue;
    for (int k = 0; k < 12; ++k) {
      const double length = height * random.between(0.05, 0.11);
      add_blade(builder,
                {.foot = tip - glm::dvec3(0, 0, 0.006 * height * k),
                 .azimuth = stem.azimuth + random.between(-1.2, 1.2),
                 .length = length,
                 .width = 0.1 * length,
                 .lean = random.between(0.1, 0.6),
                 .bend = random.between(0.5, 1.6)},
                dry);
    }
  }
  scale_to_height(builder, shape.size_m);
  return builder.take();
}

}  // namespace groundray
