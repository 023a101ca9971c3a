#pragma once

#include <vector>

#include "core/ray_tracer.h"

namespace groundray {

/// Returns the whole surface at full resolution as one level: tiles without holes as grid blocks,
/// the facets of other tiles one by one.
Level full_resolution_level(const HeightGrid& grid);

}  // namespace groundray
