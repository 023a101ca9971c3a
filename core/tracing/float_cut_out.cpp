#include "core/tracing/float_cut_out.h"

#include <array>
#include <limits>

namespace groundray {
namespace {

// Texture coordinates, in texels from the centre of the image's first one.
glm::dvec2 texels_at(const glm::vec2& uv, const glm::dvec2& size) {
  return glm::dvec2(uv.x, 1.0 - uv.y) * size - 0.5;
}

}  // namespace

// Error of the barycentric coordinates u and v, in units of 2^-24, for a box with diagonal D, a hit
// at distance t from the float ray's origin, and a triangle with longest edge e:
// - Rounding of the ray's origin and of the vertices moves the line by D against the triangle,
//   rounding of its direction by t. Double adds less than D if the origin is within 2^24 D.
// - Embree's edge function is dot(cross(c - a, c + a), direction) with corners relative to the
//   origin, so |c + a| <= 2 (t + e). Without fused operations its terms round by 5 sqrt(2) + 3
//   units of their product, and a coordinate, a ratio of edge functions, by twice as much: as if
//   the line moved by 21 (t + e). Rounding of the corners adds t + e.
// The sum is below 2 D + 32 (t + e). A line that moves by x changes a coordinate by x e over twice
// the triangle's area across the ray.
//
// Error of alpha: it is continuous, even across the image's borders, and changes by at most 255 for
// each texel along each axis. So nothing depends on which texels are interpolated.
FloatCutOuts::FloatCutOuts(const Model& model, std::span<const std::uint32_t> triangles,
                           std::span<const Source> sources, double size_m)
    : alphas_(sources.size()), farthest_m_(0x1p24 * size_m) {
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (sources[i].image == nullptr) continue;
    const Texture& image = *sources[i].image;
    const glm::ivec2 size = image.size();
    Alpha& alpha = alphas_[i];
    alpha.size = size;
    alpha.per_size = 1.0f / alpha.size;
    alpha.least = 255 * sources[i].least_alpha;
    alpha.stride = static_cast<std::size_t>(size.x) + 1;
    for (int y = 0; y <= size.y; ++y) {
      for (int x = 0; x <= size.x; ++x) {
        const glm::vec4 texel = image.texel(0, x % size.x, y % size.y);
        alpha.values.push_back(
            static_cast<std::uint8_t>(std::lround(255 * (image.has_alpha() ? texel.w : texel.x))));
      }
    }
  }
  for (const std::uint32_t number : triangles) {
    const glm::uvec3& corners = model.mesh.triangles[number];
    const std::uint16_t surface = model.surface_of[number];
    const glm::dvec2 size(alphas_[surface].size);
    std::array<glm::dvec2, 3> at;
    double longest_m = 0, largest = 0;
    for (int k = 0; k < 3; ++k) {
      const glm::vec2& uv = model.uv[corners[k]];
      at[static_cast<std::size_t>(k)] = texels_at(uv, size);
      largest = std::max({largest, std::abs(uv.x) * size.x, std::abs(uv.y) * size.y});
      longest_m = std::max(longest_m, glm::distance(model.mesh.vertices_m[corners[k]],
                                                    model.mesh.vertices_m[corners[(k + 1) % 3]]));
    }
    const glm::dvec2 by_u = at[1] - at[0], by_v = at[2] - at[0];
    const glm::dvec2 range = glm::abs(by_u) + glm::abs(by_v);
    const double far_error = 32 * 0x1p-24 * longest_m;
    const double near_error = 2 * 0x1p-24 * size_m * longest_m + far_error * longest_m;
    const double rounding =
        8 * 0x1p-24 * (size.x + size.y + range.x + range.y) + 16 * 0x1p-53 * largest + 0x1p-20;
    const bool is_sound = near_error > 1e-30 && rounding < 1;  // nothing under- or overflows
    triangles_.push_back(
        {glm::vec2(at[0] - glm::floor(at[0] / size) * size), glm::vec2(by_u), glm::vec2(by_v),
         is_sound ? static_cast<float>(near_error) : std::numeric_limits<float>::infinity(),
         static_cast<float>(far_error), static_cast<float>(255 * (range.x + range.y)),
         static_cast<float>(255 * rounding), surface});
  }
}

std::size_t FloatCutOuts::memory_bytes() const noexcept {
  std::size_t bytes = triangles_.size() * sizeof(Triangle);
  for (const Alpha& alpha : alphas_) bytes += alpha.values.size();
  return bytes;
}

}  // namespace groundray
