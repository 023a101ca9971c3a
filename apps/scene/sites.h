#pragma once

// Private to the library: what decides where the ground's covers lie and plants grow.
#include <optional>
#include <span>
#include <vector>

#include "apps/scene/ground_spec.h"
#include "core/appearance/ground_cover.h"
#include "terrain/scatter/canopy.h"
#include "terrain/scatter/scatter.h"
#include "terrain/terrain.h"
#include "terrain/water/water.h"

namespace groundray {

/// Quantities of all places of a scene's ground. Water is computed when it is needed.
class Sites {
 public:
  Sites(const TerrainSpec& spec, const Terrain& terrain);

  /// Computes the canopy of the plants that grow by then.
  /// @throws Error as canopy_cover.
  void shade(std::span<const Crown> crowns);

  /// Sets the lines, their distance limits and the mask of a layer to what its conditions say.
  /// @param mask  of the layer itself, if it has one.
  /// @throws Error as sample_ground.
  void limit(const SiteConditions& conditions, CoverLayer& layer,
             std::optional<Drape> mask = std::nullopt);
  /// Returns the share of plants that grow at a place; empty without conditions.
  /// @throws Error as sample_ground.
  ScatterSpec::Suitability suitability(const SiteConditions& conditions);

 private:
  const StandingWater& water(Wetness wetness);
  Drape mask_of(const SiteConditions::Water& condition);
  Drape mask_of_canopy(const CoverLimits& limits) const;
  Drape product(std::span<const Drape> masks) const;

  const TerrainSpec& spec_;
  const Terrain& terrain_;
  Area area_;  // of the ground
  std::optional<StandingWater> water_;
  std::optional<Drape> canopy_;
};

}  // namespace groundray
