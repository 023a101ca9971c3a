#pragma once

#include "reconstruction/dem/dem_layers.h"

namespace groundray {

/// Adds to the variance of filled heights what the measured heights they were drawn from are off
/// themselves: fill_dem tells how far ground may leave what is known around it, but takes that for
/// true. Added is the mean variance of the measured samples that are at most two rows and columns
/// from the nearest one, each as often as it has points. That is all of it, noise too, which
/// fillings average in part: where noise prevails the sum is too large by up to the noise.
///
/// Samples whose fill_sd_m is NaN, and all if nothing is measured, stay as they are. Nearest ones
/// are found by two sweeps: a sample may get one that is farther by a part of a cell. Takes time in
/// proportion to the samples, and 4 bytes for each.
/// @see Danielsson, Euclidean distance mapping, Computer Graphics and Image Processing 14 (1980).
void add_rim_variance(DemLayers& layers);

}  // namespace groundray
