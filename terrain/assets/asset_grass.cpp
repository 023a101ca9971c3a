// A tuft of grass: blades that taper, lean outward and bend increasingly towards their tips.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>

#include "core/math.h"
#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_kinds.h"

namespace groundray {
namespace {

// Dimensions of blades, as fractions of the tuft's height.
constexpr double root_spread = 0.09, root_depth = 0.03, widest = 0.012;
constexpr int segment_count = 3;

void add_blade(AssetBuilder& builder, AssetRandom& random, std::uint16_t surface) {
  // Half width at the foot of each segment; 0 at the tip.
  constexpr std::array<double, segment_count> half_width{0.8, 1.0, 0.65};
  const double towards = random.angle_rad();
  const double away = root_spread * std::sqrt(random.between(0, 1));
  glm::dvec3 p{away * math::cos(towards), away * math::sin(towards), -root_depth};
  const double azimuth = towards + 0.5 * random.normal();
  const glm::dvec3 outward{math::cos(azimuth), math::sin(azimuth), 0};
  const double length = random.between(0.45, 1.05), width = widest * random.between(0.6, 1);
  const double lean = random.between(0.03, 0.45), bend = random.between(0.1, 1.1);
  const double twist = 0.5 * random.normal();
  const glm::dvec3 across{-math::sin(azimuth), math::cos(azimuth), 0};
  std::array<std::uint32_t, std::size_t{2} * segment_count> pair{};
  for (std::size_t i = 0; i <= segment_count; ++i) {
    const double s = static_cast<double>(i) / segment_count;
    const double tilt = lean + bend * s * s;  // angle from the vertical, rad
    const glm::dvec3 along{math::sin(tilt) * outward.x, math::sin(tilt) * outward.y,
                           math::cos(tilt)};
    const glm::dvec3 face = glm::cross(across, along);
    const glm::dvec3 side = across * math::cos(twist * s) + face * math::sin(twist * s);
    const glm::dvec3 normal = glm::normalize(glm::cross(along, side));
    if (i == segment_count) {
      const std::uint32_t tip = builder.add_vertex(p, normal, {0.5, 1});
      builder.add_triangle(pair[2 * i - 2], pair[2 * i - 1], tip, surface);
      break;
    }
    const glm::dvec3 half = side * (width / 2 * half_width[i]);
    pair[2 * i] = builder.add_vertex(p - half, normal, {0, s});
    pair[2 * i + 1] = builder.add_vertex(p + half, normal, {1, s});
    if (i > 0) {
      builder.add_triangle(pair[2 * i - 2], pair[2 * i - 1], pair[2 * i + 1], surface);
      builder.add_triangle(pair[2 * i - 2], pair[2 * i + 1], pair[2 * i], surface);
    }
    p += along * (length / segment_count);
  }
}

}  // namespace

Model make_grass_tuft(AssetShape shape) {
  AssetBuilder builder;
  const std::uint16_t surface = builder.add_surface(asset_surface("dry_grass"));
  const int blades = std::max(3, static_cast<int>(std::lround(40 * shape.detail)));
  for (int i = 0; i < blades; ++i) add_blade(builder, shape.random, surface);
  double top = 0;
  for (const glm::dvec3& p : builder.model().mesh.vertices_m) top = std::max(top, p.z);
  builder.scale(shape.size_m / top);
  return builder.take();
}

}  // namespace groundray
