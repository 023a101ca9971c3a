#pragma once

#include "apps/groundray/scan_files.h"
#include "apps/groundray/scan_input.h"
#include "reconstruction/dem/dem_layers.h"

namespace groundray {

/// What tells how high the ground can be where nothing measured it: nothing, or beams that passed.
enum class SightUse { None, Beams };

/// Lowers `layers.upper_bound_m` to the heights that beams of a scan pass at. A beam that ends
/// where nothing was measured, or below what was, is left out: its point may be an outlier.
/// @param margin_m  added, see sight_bound.
/// @throws Error as read_points.
void bound_by_sight(const ScanFiles& files, const ScanFile& scan, const ScanTaking& taking,
                    double margin_m, DemLayers& layers);

}  // namespace groundray
