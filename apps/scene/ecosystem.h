#pragma once

// Private to the library: plants that compete, and their crowns.
#include <span>
#include <vector>

#include "apps/scene/scene_spec.h"
#include "core/model/model.h"
#include "terrain/scatter/canopy.h"
#include "terrain/scatter/scatter.h"

namespace groundray {

/// Extent of a model of a plant.
struct PlantExtent {
  double height_m = 0;        ///< of its highest vertex
  double crown_radius_m = 0;  ///< of a disc as large as the hull of its foliage, seen from above

  explicit PlantExtent(const Model& model);
};

/// Plants of one species of an ecosystem, by their models.
struct SpeciesPlants {
  const ScatterLayer* layer;
  std::vector<PlantExtent> models;
  /// Their scales are heights in metres until they have competed, and then scales of the models.
  std::vector<Placement> plants;

  /// @throws Error if a model does not rise above its origin.
  SpeciesPlants(const ScatterLayer& of, std::vector<PlantExtent> with_models,
                std::vector<Placement> seedlings);
};

/// Leaves the plants that survive the competition of all species, each with the model whose height
/// is nearest to its own.
void compete(std::span<SpeciesPlants> species);

}  // namespace groundray
