#pragma once

#include <optional>
#include <string>

#include "core/image/image.h"

namespace groundray::golden {

/// Shift or reflection that brings an image much nearer to the reference.
struct Misalignment {
  std::string what;       ///< "moved by (0.5, 0) px", "mirrored left to right"
  double difference = 0;  ///< mean of |a - b| / (|a| + |b|) over pixels after the change
  double as_it_is = 0;    ///< same without the change
};

/// Compares `other` with the reference after shifts of up to one pixel in steps of half a pixel
/// (bilinear), reflections and a rotation by 180 degrees. Returns the best of these if it at least
/// halves the difference; interpolation reduces pure noise by at most a fifth. Returns nothing if
/// the images differ by less than 1e-4.
/// @param reference, other  equal in size and number of channels.
std::optional<Misalignment> misalignment(const Image<double>& reference,
                                         const Image<double>& other);

}  // namespace groundray::golden
