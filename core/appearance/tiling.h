#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "core/appearance/texture.h"
#include "core/geometry/footprint.h"

namespace groundray {

/// Returns the mean colour over a footprint of a texture that is continued by `tiling`.
///
/// Repeat: Texture::color.
///
/// Stochastic: each corner of a lattice of equilateral triangles, with sides of half a copy, has
/// the image at an offset of its own, a hash of the corner. The colour is the image's mean plus
/// the corners' deviations from it, weighted so that their variance is that of the image, but no
/// darker or brighter than the corners' colours. Its expectation is the image's mean, except for
/// that limit, which shifts it little, and not at all for footprints of a copy or more.
/// @param texture  with Wrap::Repeat.
/// @see Heitz and Neyret, High-performance by-example noise using a histogram-preserving blending
///      operator, HPG (2018): the lattice, and equation 4.
glm::vec3 tiled_color(const Texture& texture, glm::dvec2 uv, const Footprint& footprint,
                      Filtering filtering, Tiling tiling) noexcept;

}  // namespace groundray
