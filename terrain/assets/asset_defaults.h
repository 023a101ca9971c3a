#pragma once

#include <optional>
#include <string_view>

#include "terrain/assets/asset.h"

namespace groundray {

/// Parameters of a kind of asset with their default values; those that the kind does not have are
/// absent. See AssetSpec for their meaning.
struct AssetDefaults {
  std::string_view size_is;  ///< meaning of size_m: "height"
  double size_m = 0;
  std::optional<double> width_m, sag_m, per_m2, leaf_area_index;
  bool has_squares = false;   ///< true if there is square_m, which is not set by default
  bool has_variants = false;  ///< true if the seed selects a variant
  bool has_detail = false;    ///< true if there is detail, which is 1 by default
  bool has_health = false;    ///< true if there is health, which is 1 by default
};

/// Returns the built-in material whose spectrum stands in for that of a surface of an asset for
/// which there is none; empty for surfaces that are named after their material.
std::string_view asset_stand_in(std::string_view surface);

/// Returns the width of the facets of the clear coat over such a surface (`Coated::alpha`); 0 if it
/// has none.
double asset_coat_alpha(std::string_view surface);

/// Returns the parameters of a kind, with the values that `make_asset` uses where none are set.
AssetDefaults asset_defaults(AssetKind kind);

}  // namespace groundray
