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

/// Picture, with its gains and tone curve.
struct DevelopedPicture {
  Picture picture;
  glm::dvec3 gains{1};  ///< factors of red, green and blue
  double lift = 1;      ///< slope of the tone curve at black; 1: none
};

/// Converts an imager's raw images to pictures. Immutable; any number of threads may use one.
/// @see docs/theory/camera_imager.md
class RawDeveloper {
 public:
  /// @throws Error listing every field that is out of bounds.
  RawDeveloper(const PictureSpec& spec, const ImagerSpec& imager);

  /// Returns the factors of red, green and blue, without automatic white balance.
  const glm::dvec3& gains() const noexcept { return gains_; }

  /// Returns the picture of a raw image and how it was made. The picture is encoded over the full
  /// range of the requested bit depth. Mosaics are demosaiced bilinearly; their outermost pixels
  /// copy the colours of their inner neighbours.
  /// @throws Error unless `raw` has one channel and, for a mosaic, at least 3 x 3 px.
  DevelopedPicture develop(const Image16& raw) const;

 private:
  // By channel and raw value, scaled to 16 bits.
  using Codes = std::array<std::vector<std::uint16_t>, 3>;

  double linear(std::size_t raised) const noexcept;
  glm::dvec3 balanced_gains(const Image16& colors) const;
  double lift(const Image16& colors, const glm::dvec3& gains) const;
  Codes codes(const glm::dvec3& gains, double lift) const;

  PictureSpec spec_;
  ColorFilter filter_;
  double raised_;  // numbers of a raw image, scaled to 16 bits, in one digital number
  double black_dn_;
  double white_dn_;  // above black
  glm::dvec3 gains_;
  Codes fixed_;  // for gains_ without a tone curve
};

}  // namespace groundray
