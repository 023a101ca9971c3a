#pragma once

#include <string>

#include "apps/groundray/describe/facts.h"
#include "terrain/assets/asset.h"

namespace groundray {

/// Returns the parameters of a kind of asset, as in a scene file, with their defaults, in one line.
std::string line_of(AssetKind kind);

/// Describes a kind of asset, and the model that it generates by default.
Facts facts_of(AssetKind kind);

}  // namespace groundray
