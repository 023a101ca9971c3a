#pragma once

#include <string>
#include <vector>

#include "apps/groundray/scan_files.h"
#include "apps/groundray/scan_input.h"
#include "reconstruction/dem/dem_layers.h"

namespace groundray {

/// What tells how high the ground can be where nothing measured it: nothing, beams that passed, or
/// these and the faces between beams of neighbours that met things far apart.
enum class SightUse { None, Beams, Faces };

/// Lowers `layers.upper_bound_m` to the heights that beams of a scan pass at. A beam that ends
/// where nothing was measured, or below what was, is left out: its point may be an outlier.
/// @param margin_m  added, see sight_bound.
/// @param notes     gets a sentence if beams are in no order, so that there are no faces.
/// @throws Error as read_points.
void bound_by_sight(const ScanFiles& files, const ScanFile& scan, const ScanTaking& taking,
                    SightUse use, double margin_m, DemLayers& layers,
                    std::vector<std::string>& notes);

}  // namespace groundray
