#pragma once

#include "core/image/image.h"
#include "core/model/model.h"

namespace groundray {

/// Kind of spray on a foliage card.
enum class SprayKind { Leaves, Needles };

/// Returns the surface of a foliage card: the material `broad_leaf`, or `leaf` for needles, with
/// the image of a spray that grows upward from the middle of the bottom row. The visible pixels
/// have on average the brightness of the material.
ModelSurface spray_surface(SprayKind kind);

/// Returns the fraction of an image that alpha leaves visible; 1 without alpha.
double opaque_share(const Image8& image);

}  // namespace groundray
