#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "core/pack.h"
#include "sensors/camera/lens/lens.h"

namespace groundray {

/// Viewing directions within a pixel, private to this library.
class PixelPatch {
 public:
  /// Largest error of a direction, as a distance in the image, px.
  static constexpr double error_px = 1e-4;

  /// @param left, right, above, below  rays of the neighbours; a direction of zero for one that has
  ///        none.
  PixelPatch(const Lens& lens, glm::dvec2 pixel, const PixelRay& ray, const PixelRay& left,
             const PixelRay& right, const PixelRay& above, const PixelRay& below) noexcept;

  /// Returns the direction, unit, at `offset_px` from the pixel's centre, half a pixel at most;
  /// nullopt if it is not imaged.
  std::optional<glm::dvec3> direction(const glm::dvec2& offset_px) const noexcept;
  /// Returns a pack of directions, zero for those that are not imaged.
  Vec3<Pack> directions(const Vec2<Pack>& offset_px) const noexcept;
  /// Returns true if a Taylor series is accurate enough; direction() evaluates the lens otherwise.
  bool is_smooth() const noexcept { return is_smooth_; }

 private:
  template <typename Real>
  Vec3<Real> by_series(const Vec2<Real>& offset_px) const noexcept;

  const Lens* lens_;
  glm::dvec2 pixel_;
  PixelRay ray_;
  glm::dvec3 by_uu_{0}, by_uv_{0}, by_vv_{0};  // 1/px^2
  bool is_smooth_ = false;
};

/// Rays of a range of rows and of the rows next to it, private to this library.
class RayRows {
 public:
  explicit RayRows(const Lens& lens) : lens_(lens) {}

  /// Computes the rays of rows from `begin` to before `end`.
  void fill(int begin, int end);

  /// Returns true if a pixel's centre has a viewing direction.
  bool looks(glm::ivec2 pixel) const noexcept {
    return ray(pixel.x, pixel.y).direction != glm::dvec3(0);
  }
  PixelPatch patch(glm::ivec2 pixel) const noexcept;

 private:
  const PixelRay& ray(int x, int y) const noexcept;

  const Lens& lens_;
  int first_ = 0, end_ = 0;
  std::vector<PixelRay> rays_;
};

}  // namespace groundray
