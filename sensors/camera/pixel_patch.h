#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "sensors/camera/lens.h"

namespace groundray {

/// Where the places in a pixel look, private to this library.
class PixelPatch {
 public:
  /// Places are known to so much of where they are asked for.
  static constexpr double error_px = 1e-4;

  /// @param neighbours  to the left, right, above and below; those that look nowhere have a
  ///        direction of zero.
  PixelPatch(const Lens& lens, glm::dvec2 pixel, const PixelRay& ray, const PixelRay& left,
             const PixelRay& right, const PixelRay& above, const PixelRay& below) noexcept;

  /// Returns the direction, unit, of the place `offset_px` from the pixel's centre, half a pixel at
  /// most; nothing if it is not imaged.
  std::optional<glm::dvec3> direction(const glm::dvec2& offset_px) const noexcept;
  /// Whether a parabola through the neighbours' rays is enough; else the lens is asked.
  bool is_smooth() const noexcept { return is_smooth_; }

 private:
  const Lens* lens_;
  glm::dvec2 pixel_;
  PixelRay ray_;
  glm::dvec3 by_uu_{0}, by_uv_{0}, by_vv_{0};  // 1/px^2
  bool is_smooth_ = false;
};

/// The rays of some rows of pixels and of the rows beside them, private to this library.
class RayRows {
 public:
  RayRows(const Lens& lens, int begin, int end);

  /// Whether a pixel's centre looks anywhere.
  bool looks(glm::ivec2 pixel) const noexcept {
    return ray(pixel.x, pixel.y).direction != glm::dvec3(0);
  }
  PixelPatch patch(glm::ivec2 pixel) const noexcept;

 private:
  const PixelRay& ray(int x, int y) const noexcept;

  const Lens& lens_;
  int first_, end_;
  std::vector<PixelRay> rays_;
};

}  // namespace groundray
