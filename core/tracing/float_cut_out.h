#pragma once

// Cut-out tests in float. Most hits on cut-out surfaces lie so far from the outline of what is cut
// out that float is precise enough to decide; the others are left to double.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/appearance/texture.h"
#include "core/model/model.h"

namespace groundray {

/// Result of a cut-out test in float. All but `Unsure` hold in double, too: the ray passes inside
/// the triangle, and the surface is opaque or transparent there.
enum class CutOut { Transparent, Opaque, Unsure };

/// Embree's hit on a triangle: barycentric coordinates of the second and third corner, the ray's
/// parameter there, the normal, whose length is twice the triangle's area, and the ray's direction.
struct CutOutHit {
  float u, v, t;
  glm::vec3 normal, direction;
};

/// Cut-outs of a model's triangles. Memory: 44 bytes for each triangle, and one byte for each texel
/// of the images.
class FloatCutOuts {
 public:
  /// An image that cuts out, and the alpha below which it does; no image for a whole surface.
  struct Source {
    const Texture* image = nullptr;
    float least_alpha = 0;
  };

  /// Constructs cut-outs of no triangles.
  FloatCutOuts() = default;
  /// @param triangles  those that have cut-outs.
  /// @param sources  by surface.
  /// @param size_m  diagonal of the model's bounding box.
  FloatCutOuts(const Model& model, std::span<const std::uint32_t> triangles,
               std::span<const Source> sources, double size_m);

  /// Tests a hit.
  /// @param index  of the triangle among those given to the constructor.
  /// @param origin  of the ray, in O.
  CutOut at(std::size_t index, const glm::dvec3& origin, const CutOutHit& hit) const noexcept {
    const Triangle& triangle = triangles_[index];
    const float length = glm::length(hit.direction);
    const float error = (triangle.near_error + triangle.far_error * (hit.t * length)) * length /
                        std::abs(glm::dot(hit.normal, hit.direction));  // of u and v
    const bool is_known =
        std::min({hit.u, hit.v, 1 - hit.u - hit.v}) > error && error < most_error &&
        length > least_length &&
        std::max({std::abs(origin.x), std::abs(origin.y), std::abs(origin.z)}) < farthest_m_;
    if (!is_known) [[unlikely]]
      return CutOut::Unsure;
    const Alpha& alpha = alphas_[triangle.surface];
    const float over =
        alpha.at(triangle.corner + hit.u * triangle.by_u + hit.v * triangle.by_v) - alpha.least;
    if (!(std::abs(over) > triangle.slope * error + triangle.rounding)) return CutOut::Unsure;
    return static_cast<CutOut>(over > 0);  // predicting a branch here would often fail
  }

  std::size_t memory_bytes() const noexcept;

 private:
  static constexpr float most_error = 0x1p-4f;
  static constexpr float least_length = 0x1p-20f;  // direction_float() rounds shorter ones to 0

  // Alpha of an image, 0 to 255; the first column and row are repeated behind the last.
  struct Alpha {
    glm::vec2 size{1}, per_size{1};
    float least = 0;
    std::size_t stride = 0;
    std::vector<std::uint8_t> values;

    // Interpolates at a point, counted in texels from the centre of the first one; the image
    // repeats.
    float at(glm::vec2 texel) const noexcept {
      texel -= glm::floor(texel * per_size) * size;
      texel = glm::clamp(texel, glm::vec2(0), size);
      const glm::vec2 whole = glm::min(glm::floor(texel), size - 1.0f);
      const glm::vec2 t = texel - whole;
      const std::uint8_t* const row =
          &values[static_cast<std::size_t>(static_cast<int>(whole.y)) * stride +
                  static_cast<std::size_t>(static_cast<int>(whole.x))];
      const auto mix = [&](const std::uint8_t* of) {
        return static_cast<float>(of[0]) + t.x * static_cast<float>(of[1] - of[0]);
      };
      const float upper = mix(row), lower = mix(row + stride);
      return upper + t.y * (lower - upper);
    }
  };

  // Texture coordinates in texels, as Alpha::at() takes them, and errors.
  struct Triangle {
    glm::vec2 corner, by_u, by_v;
    float near_error, far_error;  // of u and v, times the area across the ray: at the ray's
                                  // origin, and by distance from it
    float slope;                  // error of alpha by that of u and v
    float rounding;               // error of alpha otherwise
    std::uint32_t surface;
  };

  std::vector<Triangle> triangles_;
  std::vector<Alpha> alphas_;  // by surface
  double farthest_m_ = 0;      // of the origin of a ray; double is too coarse beyond
};

}  // namespace groundray
