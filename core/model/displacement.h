#pragma once

#include <cstddef>

#include "core/image/image.h"
#include "core/model/model.h"

namespace groundray {

/// An image that displaces a surface along its normals by amplitude_m (value - middle). The value
/// is that of the first channel, interpolated linearly between pixels; the image repeats.
struct Displacement {
  ImageF image;
  double amplitude_m = 0;  ///< displacement for a difference of 1 in value
  double middle = 0.5;     ///< value without displacement
  double cell_m = 0.01;    ///< greatest edge length before displacement; positive
};

/// Greatest number of triangles of a displaced model.
inline constexpr std::size_t most_displaced_triangles = std::size_t{1} << 24;

/// Returns the model with its surface displaced as geometry, so that all sensors see it. Edges
/// longer than a cell are halved until none remain, consistently in neighbouring triangles. Then
/// each position moves along its normal: the mean normal of its vertices or, without these, the
/// area-weighted mean of its facets' normals. Vertices at the same position move by the mean of the
/// values at their uv, so no seam opens. Vertex normals are recomputed from the displaced facets.
/// @throws Error if the model has no uv; a number or pixel is not finite; a cell or amplitude is
///         not positive; or the result would exceed most_displaced_triangles (with the estimated
///         number).
Model displaced(const Model& model, const Displacement& by);

}  // namespace groundray
