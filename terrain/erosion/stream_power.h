#pragma once

// Private to erosion: incision by streams.
#include <span>

#include "terrain/erosion/erosion.h"
#include "terrain/erosion/flow_tree.h"

namespace groundray {

/// Lets streams incise for `years`, in one implicit step. Samples in standing water keep their
/// heights.
/// @param areas_m2  drained areas.
/// @see Braun, Willett, Geomorphology 180-181 (2013), 170-179.
void incise(const FlowTree& tree, std::span<const double> areas_m2, const StreamPower& law,
            double years, std::span<double> heights_m);

}  // namespace groundray
