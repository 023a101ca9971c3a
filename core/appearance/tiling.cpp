#include "core/appearance/tiling.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <limits>

#include "core/mixed_bits.h"

namespace groundray {
namespace {

constexpr double triangles_per_copy = 2;  // sides along u; our choice
// Weights below this share of all are 0, so that most points need one or two lookups.
constexpr double least_share = 0.02;

// Corners of the triangle around a point, and their weights with sum 1.
struct Corners {
  std::array<glm::dvec2, 3> at;
  std::array<double, 3> weights;
};

Corners corners_around(glm::dvec2 uv) noexcept {
  // Coordinates in which the lattice is that of squares with a diagonal.
  const double y = uv.y * triangles_per_copy * 1.1547005383792515;  // 2 / sqrt(3)
  const double x = uv.x * triangles_per_copy - y / 2;
  const glm::dvec2 cell(std::floor(x), std::floor(y));
  const double s = x - cell.x, t = y - cell.y;
  if (s + t < 1)
    return {{cell, cell + glm::dvec2(1, 0), cell + glm::dvec2(0, 1)}, {1 - s - t, s, t}};
  return {{cell + glm::dvec2(1, 1), cell + glm::dvec2(0, 1), cell + glm::dvec2(1, 0)},
          {s + t - 1, 1 - s, 1 - t}};
}

// Narrows the transitions between pieces, which keeps stones and leaves whole in most places.
void sharpen(std::array<double, 3>& weights) noexcept {
  double sum = 0;
  for (double& weight : weights) {
    const double square = weight * weight;
    weight = square * square * square;
    sum += weight;
  }
  double left = 0;
  for (double& weight : weights) left += weight = std::fmax(weight / sum - least_share, 0);
  for (double& weight : weights) weight /= left;
}

// Returns an offset in [0, 1)^2 for a corner of the lattice: the finalizer of SplitMix64.
glm::dvec2 offset_of(glm::dvec2 corner) noexcept {
  std::uint64_t bits = static_cast<std::uint64_t>(static_cast<std::int64_t>(corner.x)) << 32 ^
                       static_cast<std::uint32_t>(static_cast<std::int64_t>(corner.y));
  bits = mixed_bits(bits + golden_step);
  return {static_cast<double>(bits >> 32) * 0x1p-32,
          static_cast<double>(static_cast<std::uint32_t>(bits)) * 0x1p-32};
}

}  // namespace

glm::vec3 tiled_color(const Texture& texture, glm::dvec2 uv, const Footprint& footprint,
                      Filtering filtering, Tiling tiling) noexcept {
  if (tiling == Tiling::Repeat) return texture.color(uv, footprint, filtering);
  constexpr double most = 1e9;  // farther points, and NaN, are not on any ground
  const bool is_far = !(std::abs(uv.x) < most && std::abs(uv.y) < most);
  Corners corners = corners_around(is_far ? glm::dvec2(0) : uv);
  sharpen(corners.weights);
  const glm::vec3 mean(texture.mean());
  glm::vec3 deviation(0), low(std::numeric_limits<float>::max()), high(-low);
  double squares = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double weight = corners.weights[i];
    if (weight == 0) continue;
    const glm::dvec2 place = (is_far ? glm::dvec2(0) : uv) + offset_of(corners.at[i]);
    const glm::vec3 color = texture.color(place, footprint, filtering);
    deviation += static_cast<float>(weight) * (color - mean);
    low = glm::min(low, color), high = glm::max(high, color);
    squares += weight * weight;
  }
  return glm::clamp(mean + deviation / static_cast<float>(std::sqrt(squares)), low, high);
}

}  // namespace groundray
