#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/drape.h"
#include "core/footprint.h"
#include "core/texture.h"
#include "core/tint.h"

namespace groundray {

/// Textures that repeat over the ground, laid on along the axes of D (see triplanar_color).
struct GroundTexture {
  std::shared_ptr<const Texture> albedo;  ///< or null
  std::shared_ptr<const Texture> normal;  ///< green up, as in core/model.h; or null
  double size_m = 1;                      ///< of one copy; positive
};

/// Where a layer lies, by a quantity: between two limits, each of them a ramp of width `blend`
/// with its middle there; 0 for a step.
struct CoverLimits {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  double blend = 0;

  /// Returns 1 inside, 0 outside, and on a ramp how far up it `value` is.
  double share(double value) const noexcept;
};

/// One of the ground's materials, and where it lies. Its share of the ground there is the product
/// of what its limits and its mask say.
struct CoverLayer {
  std::uint16_t material = 0;         ///< index among the scene's
  std::uint16_t label = 0;            ///< semantic class
  CoverLimits slope_rad{};            ///< of the facet that is hit
  CoverLimits height_m{};             ///< in D
  std::shared_ptr<const Drape> mask;  ///< its first channel, 0 to 1; 0 outside; or null
  std::optional<GroundTexture> texture;
};

/// What the ground is made of, layer over layer: each hides as much of those below as its share
/// says. Immutable; copies share it, and any number of threads may ask.
/// @see docs/textures.md
class GroundCover {
 public:
  static constexpr std::size_t most_layers = 8;

  /// A point of the ground, for means: in D, with the unit normal.
  struct Point {
    glm::dvec3 p_D{0};
    glm::dvec3 normal{0, 0, 1};
  };

  /// Nothing: the ground is one material.
  GroundCover() = default;
  /// @param layers  from the lowest to the uppermost; the lowest lies everywhere, so its limits and
  ///        mask must be left as they are.
  /// @param orthophoto  what the ground looks like from above, or null. Each layer's part of it
  ///        stands for how that layer varies.
  /// @param points  over all of the orthophoto: for its mean over each layer.
  /// @throws Error if there are no layers or more than most_layers, the lowest has limits or a
  ///         mask, a limit is NaN or crosses the other, a blend is negative or not finite, or a
  ///         texture's size is not positive.
  GroundCover(std::vector<CoverLayer> layers, std::shared_ptr<const Drape> orthophoto,
              std::span<const Point> points);

  bool empty() const noexcept { return layers_.empty(); }
  std::span<const CoverLayer> layers() const noexcept { return layers_; }

  /// How much of a point each layer has: not negative, sum 1.
  using Shares = std::array<float, most_layers>;
  Shares shares_at(const Point& point) const noexcept;

  /// Returns how a layer varies at a point.
  /// @param patch  what is seen of the ground there.
  Tint tint_at(std::size_t layer, const Point& point, const SurfacePatch& patch,
               Filtering filtering) const noexcept;

  /// Returns the normal to shade a point with, unit: the mean of the layers' by their shares.
  glm::dvec3 shading_normal_at(const Point& point, const SurfacePatch& patch,
                               Filtering filtering) const noexcept;

 private:
  std::vector<CoverLayer> layers_;
  std::shared_ptr<const Drape> orthophoto_;
  std::array<glm::vec3, most_layers> means_{};  // of the orthophoto, by layer
};

}  // namespace groundray
