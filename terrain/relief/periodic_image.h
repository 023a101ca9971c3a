#pragma once

// Private to the library: a periodic image, sampled on a lattice.
#include <glm/vec2.hpp>
#include <vector>

#include "core/image/image.h"
#include "terrain/lod/pass.h"

namespace groundray {

/// Returns the first channel of an image on `size` samples that it covers `copies` times, row by
/// row; pixel (0, 0) is centred on sample (0, 0). The filter is a tent as wide as two pixels or two
/// samples, whichever is more: linear interpolation, or a mean where pixels are finer.
std::vector<double> sample_periodic(const ImageF& image, glm::ivec2 size, glm::ivec2 copies,
                                    const PassRunner& runner = {});

}  // namespace groundray
