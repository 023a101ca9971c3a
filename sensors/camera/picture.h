#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <variant>
#include <vector>

#include "core/image/image.h"
#include "sensors/camera/camera_spec.h"

namespace groundray {

/// Image for viewing: red, green and blue, or grey.
using Picture = std::variant<Image8, Image16>;

/// Converts an imager's raw images to pictures. Immutable; any number of threads may use one.
/// @see docs/theory/camera_imager.md
class RawDeveloper {
 public:
  /// @throws Error listing every field that is out of bounds.
  RawDeveloper(const PictureSpec& spec, const ImagerSpec& imager);

  /// Returns the factors of red, green and blue.
  const glm::dvec3& gains() const noexcept { return gains_; }

  /// Returns the picture of a raw image, encoded over the full range of the requested bit depth.
  /// Mosaics are demosaiced bilinearly; their outermost pixels copy the colours of their inner
  /// neighbours.
  /// @throws Error unless `raw` has one channel and, for a mosaic, at least 3 x 3 px.
  Picture develop(const Image16& raw) const;

 private:
  template <typename T>
  Image<T> encoded(const Image16& colors) const;

  PictureSpec spec_;
  ColorFilter filter_;
  int bits_;  // bit depth of raw images
  glm::dvec3 gains_;
  std::array<std::vector<std::uint16_t>, 3> codes_;  // by channel and raw value, scaled to 16 bits
};

}  // namespace groundray
