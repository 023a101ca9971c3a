#pragma once

#include "core/tracing/sway.h"
#include "terrain/assets/asset.h"

namespace groundray {

/// Returns how an asset yields to wind; `lean_rad` is 0 for all but plants.
/// @see docs/reference/wind.md: values and their sources.
Flexibility asset_flexibility(const AssetSpec& spec);

}  // namespace groundray
