#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <variant>
#include <vector>

#include "core/image.h"
#include "sensors/camera/camera_spec.h"

namespace groundray {

/// An image to look at: red, green and blue, or grey.
using Picture = std::variant<Image8, Image16>;

/// Makes pictures of an imager's raw images. Immutable; any number of threads may use one.
/// @see docs/camera_imager.md
class RawDeveloper {
 public:
  /// @throws Error listing every field that is out of bounds.
  RawDeveloper(const PictureSpec& spec, const ImagerSpec& imager);

  /// What red, green and blue are multiplied by.
  const glm::dvec3& gains() const noexcept { return gains_; }

  /// Returns the picture of a raw image, encoded and of as many bits as asked for, over all of
  /// them. Colours are interpolated bilinearly; the outermost pixels of a mosaic have those of the
  /// next.
  /// @throws Error unless `raw` has one channel and, of a mosaic, at least 3 x 3 px.
  Picture develop(const Image16& raw) const;

 private:
  template <typename T>
  Image<T> encoded(const Image16& colors) const;

  PictureSpec spec_;
  ColorFilter filter_;
  int bits_;  // of raw images
  glm::dvec3 gains_;
  std::array<std::vector<std::uint16_t>, 3> codes_;  // of each channel's values, raised to 16 bits
};

}  // namespace groundray
