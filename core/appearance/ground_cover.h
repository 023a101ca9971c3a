#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/appearance/texture.h"
#include "core/geometry/footprint.h"
#include "core/geometry/line_field.h"

namespace groundray {

/// An image draped over the ground from above, its first row in the north. Immutable; any number of
/// threads may query it.
struct Drape {
  Texture image;            ///< with Wrap::Clamp
  glm::dvec2 corner_m{0};   ///< lower left (south-western) corner of the image, in D
  glm::dvec2 size_m{1, 1};  ///< size of the image along x and y; positive

  /// Returns the texture coordinates of `p` (D).
  glm::dvec2 uv_at(glm::dvec2 p) const noexcept { return (p - corner_m) / size_m; }

  /// Returns true if `p` (D) is in the image or on its boundary; false for NaN.
  bool covers(glm::dvec2 p) const noexcept {
    const glm::dvec2 uv = uv_at(p);
    return 0 <= uv.x && uv.x <= 1 && 0 <= uv.y && uv.y <= 1;
  }
};

/// Textures that repeat over the ground, projected along the axes of D (see triplanar_color).
struct GroundTexture {
  std::shared_ptr<const Texture> albedo;  ///< or null
  std::shared_ptr<const Texture> normal;  ///< green up, as in core/model/model.h; or null
  double size_m = 1;                      ///< side of one copy; positive
  Tiling tiling = Tiling::Repeat;
  glm::dvec2 corner_m{0};  ///< lower left corner of a copy, in D
};

/// Range of a quantity in which a layer lies. Each limit is the centre of a ramp of width `blend`;
/// 0 for a step.
struct CoverLimits {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  double blend = 0;

  /// Returns 1 inside, 0 outside, and the ramp's value from 0 to 1 between.
  double share(double value) const noexcept;
};

/// Line on the ground, or a pair of lines beside it, from which distances are measured.
struct CoverLine {
  std::shared_ptr<const LineField> field;
  double aside_m = 0;       ///< distance of the pair from the field's line
  double half_width_m = 0;  ///< distances count from here on, and are negative nearer

  /// Returns the distance of `p` (D); the largest double beyond the field's reach.
  double distance_m(glm::dvec2 p) const noexcept;
};

/// One of the ground's materials and its extent. The layer's weight at a point is the product of
/// the values of its limits and of its mask.
struct CoverLayer {
  std::uint16_t material = 0;         ///< index among the scene's materials
  std::uint16_t label = 0;            ///< semantic class
  CoverLimits slope_rad{};            ///< of the ground (see Point)
  CoverLimits height_m{};             ///< in D
  CoverLimits distance_m{};           ///< from the nearest of `lines`, if there are any
  std::vector<CoverLine> lines{};     ///< with fields that reach as far as the limits
  std::shared_ptr<const Drape> mask;  ///< weight in its first channel, 0 to 1; 0 outside; or null
  std::optional<GroundTexture> texture;
};

/// Layers of materials that cover the ground. Each layer hides the layers below it in proportion to
/// its weight. Immutable; copies share it, and any number of threads may query it.
/// @see docs/reference/textures.md
class GroundCover {
 public:
  static constexpr std::size_t most_layers = 8;

  /// A point of the ground: position in D, unit normal of its facet, and slope, which decides on
  /// the layers there.
  struct Point {
    glm::dvec3 p_D{0};
    glm::dvec3 normal{0, 0, 1};
    double slope_rad = 0;
  };

  /// Returns the point of a facet, with the facet's slope.
  static Point on_facet(const glm::dvec3& p_D, const glm::dvec3& normal) noexcept;

  /// Constructs no layers: the ground is one material.
  GroundCover() = default;
  /// @param layers  from the lowest to the uppermost. The lowest lies everywhere, so its limits and
  ///                mask must be defaults.
  /// @param orthophoto  image of the ground from above, or null. It determines how each layer
  ///                    varies about its mean.
  /// @param points  samples over all of the orthophoto, for its mean over each layer.
  /// @throws Error if there are no layers or more than most_layers, the lowest has limits or a
  ///         mask, a limit is NaN or crosses the other, a blend is negative or not finite, or a
  ///         texture's size is not positive.
  GroundCover(std::vector<CoverLayer> layers, std::shared_ptr<const Drape> orthophoto,
              std::span<const Point> points);

  bool empty() const noexcept { return layers_.empty(); }
  /// Returns whether slopes decide on a layer.
  bool depends_on_slope() const noexcept { return depends_on_slope_; }
  std::span<const CoverLayer> layers() const noexcept { return layers_; }

  /// Share of each layer at a point: not negative, sum 1.
  using Shares = std::array<float, most_layers>;
  Shares shares_at(const Point& point) const noexcept;

  /// Returns the variation of a layer at a point, relative to its mean.
  /// @param patch  footprint of the ray on the ground.
  Tint tint_at(std::size_t layer, const Point& point, const SurfacePatch& patch,
               Filtering filtering) const noexcept;

  /// Returns the shading normal at a point, unit: the mean of the layers' normals, weighted by
  /// share.
  glm::dvec3 shading_normal_at(const Point& point, const SurfacePatch& patch,
                               Filtering filtering) const noexcept;

 private:
  std::vector<CoverLayer> layers_;
  bool depends_on_slope_ = false;
  std::shared_ptr<const Drape> orthophoto_;
  std::array<glm::vec3, most_layers> means_{};  // of the orthophoto, by layer
};

}  // namespace groundray
