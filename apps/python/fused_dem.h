#pragma once

#include "apps/python/binding/arrays.h"
#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/dem/fusion/dem_fusion.h"

namespace groundray::python {

/// Fused DEM.
struct FusedDem {
  DemLayers layers;
  FusionCounts counts;
};

/// Returns the values from which restored_dem makes an equal DEM.
nb::list state_of(nb::handle_t<FusedDem> self);

/// Makes a DEM from a pickle.
/// @throws Error naming the damaged value.
FusedDem restored_dem(const nb::tuple& values);

}  // namespace groundray::python
