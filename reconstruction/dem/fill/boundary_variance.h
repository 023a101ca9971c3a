#pragma once

#include "reconstruction/dem/dem_layers.h"

namespace groundray {

/// Adds the variance of the surrounding measured heights to that of filled heights: fill_dem
/// estimates how much the ground deviates from the known heights around it, but takes these as
/// exact. Adds the mean variance of the measured samples at most two rows and columns from the
/// nearest one, weighted by their numbers of points. This includes all of the noise, which fills
/// average in part: where noise prevails, the sum is too large by up to the noise.
///
/// Samples whose fill_sd_m is NaN stay unchanged, and so do all if nothing is measured. Nearest
/// samples are determined by two sweeps, which may return one that is farther by a fraction of a
/// cell. The time is proportional to the number of samples; memory is 4 bytes for each.
/// @see Danielsson, Euclidean distance mapping, Computer Graphics and Image Processing 14 (1980).
void add_boundary_variance(DemLayers& layers);

}  // namespace groundray
