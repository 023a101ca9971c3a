#pragma once

#include <cstddef>

#include "core/image.h"
#include "core/model.h"

namespace groundray {

/// An image that moves a surface in and out along its normals: by amplitude_m (value - middle),
/// value the first channel, linear between pixels, repeated.
struct Displacement {
  ImageF image;
  double amplitude_m = 0;  ///< of a difference of 1
  double middle = 0.5;     ///< the value that leaves the surface where it is
  double cell_m = 0.01;    ///< no edge of a facet is longer, before it is displaced; positive
};

/// A displaced model has at most so many triangles.
inline constexpr std::size_t most_displaced_triangles = std::size_t{1} << 24;

/// Returns the model with its surface displaced: geometry, as all sensors see it. Edges longer than
/// a cell are halved until none is, neighbours alike; then each place moves along its normal (the
/// mean of its vertices' or, where there are none, of its facets' by area). Vertices in one place
/// stay together, at the mean of what their uv say, so that no seam opens. Normals of vertices
/// become those of the displaced facets.
/// @throws Error if the model has no uv; a number or pixel is not finite; a cell or amplitude is
///         not positive; or, with the number, if it takes more than most_displaced_triangles.
Model displaced(const Model& model, const Displacement& by);

}  // namespace groundray
