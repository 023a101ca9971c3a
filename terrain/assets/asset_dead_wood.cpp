// Fallen logs and stumps.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numbers>
#include <vector>

#include "core/math.h"
#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_kinds.h"

namespace groundray {
namespace {

int log_sides(double usual, double detail) {
  return std::max(6, static_cast<int>(std::lround(usual * std::sqrt(detail))));
}

// Adds a closed disc with sharp edges, as cut or broken wood, whose face is at `face`.
void add_cut(AssetBuilder& builder, const glm::dvec3& face, const glm::dvec3& outward,
             double radius, int sides, std::uint16_t surface) {
  const glm::dvec3 side = glm::normalize(glm::cross(outward, glm::dvec3(0, 0, 1)));
  const glm::dvec3 up = glm::cross(outward, side), back = face - outward * (0.3 * radius);
  const auto first = static_cast<std::uint32_t>(builder.model().mesh.vertices_m.size());
  const auto k = static_cast<std::uint32_t>(sides);
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    const glm::dvec2 at{math::cos(angle), math::sin(angle)};
    const glm::dvec3 out = side * at.x + up * at.y;
    const glm::dvec2 uv = (at + 1.0) / 2.0;
    builder.add_vertex(back + radius * out, out, {uv.x, 0});
    builder.add_vertex(face + radius * out, out, {uv.x, 1});
    builder.add_vertex(back + radius * out, -outward, uv);
    builder.add_vertex(face + radius * out, outward, uv);
  }
  for (std::uint32_t s = 0; s < k; ++s) {
    const std::uint32_t a = first + 4 * s, b = first + 4 * ((s + 1) % k);
    builder.add_triangle(a, b, b + 1, surface);
    builder.add_triangle(a, b + 1, a + 1, surface);
    if (s == 0 || s + 1 == k) continue;
    builder.add_triangle(first + 2, b + 2, a + 2, surface);
    builder.add_triangle(first + 3, a + 3, b + 3, surface);
  }
}

}  // namespace

// A slightly bent stem that lies along x, a fifth of its diameter in the ground, with stubs of
// branches. Both ends show the wood.
Model make_fallen_log(AssetShape shape) {
  AssetRandom& random = shape.random;
  AssetBuilder builder;
  const std::uint16_t bark = builder.add_surface(asset_surface("bark"));
  const std::uint16_t wood = builder.add_surface(asset_surface("wood"));
  const double length = shape.size_m, thick = shape.width_m / 2;
  const double taper = random.between(0.3, 0.5), bend = random.between(-0.03, 0.03) * length;
  const int sides = log_sides(16, shape.detail);
  const auto radius = [&](double s) { return thick * (1 - taper * s); };
  const auto center = [&](double s) {
    const double arc = 4 * s * (1 - s);
    return glm::dvec3((s - 0.5) * length, bend * arc, 0.6 * radius(s) + 0.2 * std::abs(bend) * arc);
  };
  constexpr int pieces = 14;
  std::vector<TubeRing> rings;
  for (int i = 0; i <= pieces; ++i) {
    const double s = static_cast<double>(i) / pieces;
    rings.push_back({center(s), radius(s) * random.between(0.95, 1.05)});
  }
  builder.add_tube(rings, sides, bark);
  // The wood stands out slightly.
  const glm::dvec3 back = glm::normalize(rings[0].p - rings[1].p);
  const glm::dvec3 ahead = glm::normalize(rings[pieces].p - rings[pieces - 1].p);
  const double proud = 0.03 * thick;
  add_cut(builder, rings[0].p + proud * back, back, 0.9 * rings[0].radius, sides, wood);
  add_cut(builder, rings[pieces].p + proud * ahead, ahead, 0.9 * rings[pieces].radius, sides, wood);
  const int stubs = 3 + static_cast<int>(random.between(0, 5));
  for (int i = 0; i < stubs; ++i) {
    const double s = random.between(0.25, 0.95), around = random.between(-1.2, 1.2);
    const glm::dvec3 up{0.5, math::sin(around), math::cos(around)};
    const double r = radius(s), stub = r * random.between(1.2, 5);
    const glm::dvec3 away = glm::normalize(up), crook = 0.15 * stub * random.direction();
    builder.add_tube(
        std::array<TubeRing, 4>{{{center(s), 0.26 * r},
                                 {center(s) + away * r, 0.22 * r},
                                 {center(s) + away * (r + 0.6 * stub) + crook, 0.15 * r},
                                 {center(s) + away * (r + stub) + 1.5 * crook, 0}}},
        6, bark);
  }
  double low = 0, high = 0;
  for (const glm::dvec3& p : builder.model().mesh.vertices_m) {
    low = std::min(low, p.x);
    high = std::max(high, p.x);
  }
  builder.scale(length / (high - low));
  return builder.take();
}

// A sawn stump that widens into roots.
Model make_stump(AssetShape shape) {
  AssetRandom& random = shape.random;
  AssetBuilder builder;
  const std::uint16_t bark = builder.add_surface(asset_surface("bark"));
  const std::uint16_t wood = builder.add_surface(asset_surface("wood"));
  const double height = shape.size_m, r = shape.width_m / 2;
  const int sides = log_sides(18, shape.detail);
  std::vector<TubeRing> rings;
  for (const double z : {-0.25, -0.1, 0.05, 0.15, 0.3, 0.6, 0.98}) {
    const double wide = 1 + 0.5 * math::exp(-std::max(z, 0.0) * height / (0.5 * r));
    rings.push_back({{0, 0, z * height}, r * wide * random.between(0.97, 1.03)});
  }
  builder.add_tube(rings, sides, bark);
  builder.add_cylinder({0, 0, 0.9 * height}, 0.1 * height, 0.9 * r, sides, wood);
  constexpr int roots = 6;
  const double turn = random.angle_rad();
  for (int i = 0; i < roots; ++i) {
    const double angle = turn + 2 * std::numbers::pi * (i + random.between(-0.3, 0.3)) / roots;
    const glm::dvec3 out{math::cos(angle), math::sin(angle), 0};
    const glm::dvec3 aside{-out.y, out.x, 0};
    const double reach = r * random.between(1.8, 2.6), curl = random.between(-0.4, 0.4) * r;
    builder.add_tube(
        std::array<TubeRing, 4>{
            {{out * (0.6 * r) + glm::dvec3(0, 0, 0.6 * r), 0.38 * r},
             {out * (1.3 * r) + glm::dvec3(0, 0, 0.08 * r), 0.34 * r},
             {out * (0.5 * (r + reach)) + 0.5 * curl * aside - glm::dvec3(0, 0, 0.08 * r),
              0.24 * r},
             {out * reach + curl * aside - glm::dvec3(0, 0, 0.3 * r), 0}}},
        8, bark);
  }
  return builder.take();
}

}  // namespace groundray
