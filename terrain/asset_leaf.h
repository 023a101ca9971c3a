#pragma once

#include "core/image.h"
#include "core/model.h"

namespace groundray {

/// Sprays that a card of foliage shows.
enum class SprayKind { Leaves, Needles };

/// Returns the surface of a card of foliage: the material `broad_leaf`, or `leaf` for needles, with
/// an image of a spray that grows up from the middle of the lowest row. What the image shows is on
/// average as bright as the material.
ModelSurface spray_surface(SprayKind kind);

/// Returns the share of an image that its alpha leaves standing; 1 without alpha.
double opaque_share(const Image8& image);

}  // namespace groundray
