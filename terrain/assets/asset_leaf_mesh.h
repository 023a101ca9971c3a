#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_kinds.h"
#include "terrain/assets/asset_plant.h"

namespace groundray {

/// Sizes of the twigs of a plant, in its unit of length, and the leaf area that they bear.
struct TwigStyle {
  LeafForm leaf;
  double twig_length = 0, twig_radius = 0;
  double leaf_area_index = 0;
  std::string_view material;  ///< of the leaves
  std::uint16_t bark = 0;     ///< surface of the twigs
};

/// Returns the one-sided area of a leaf of length 1.
double unit_leaf_area(const LeafForm& leaf);

/// Adds each spray as a twig, a closed tube, with leaves as geometry. The length of the leaves
/// gives the leaf area index.
void add_twigs(AssetBuilder& builder, std::span<const Spray> sprays, const TwigStyle& style,
               AssetRandom& random);

}  // namespace groundray
