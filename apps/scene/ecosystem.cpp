#include "apps/scene/ecosystem.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "terrain/assets/asset.h"
#include "terrain/scatter/competition.h"

namespace groundray {
namespace {

// Returns the index of the model whose height has the smallest ratio to that of a plant.
std::uint32_t nearest_model(std::span<const PlantExtent> models, double height_m) {
  const auto ratio = [&](const PlantExtent& model) {
    return std::max(model.height_m / height_m, height_m / model.height_m);
  };
  return static_cast<std::uint32_t>(std::ranges::min_element(models, {}, ratio) - models.begin());
}

}  // namespace

PlantExtent::PlantExtent(const Model& model)
    : crown_radius_m(std::sqrt(foliage_area(model).crown_m2 / std::numbers::pi)) {
  for (const auto& vertex_m : model.mesh.vertices_m)
    height_m = std::max(height_m, static_cast<double>(vertex_m.z));
}

SpeciesPlants::SpeciesPlants(const ScatterLayer& of, std::vector<PlantExtent> with_models,
                             std::vector<Placement> seedlings)
    : layer(&of), models(std::move(with_models)), plants(std::move(seedlings)) {
  if (!std::ranges::all_of(models, [](const auto& model) { return model.height_m > 0; }))
    throw Error("the model of a plant must rise above its origin, along z");
}

void compete(std::span<SpeciesPlants> species) {
  std::vector<Contender> contenders;
  for (std::size_t i = 0; i < species.size(); ++i) {
    SpeciesPlants& of = species[i];
    const SpeciesSpec& spec = of.layer->species.value();
    for (Placement& plant : of.plants) {
      const double height_m = plant.scale;
      plant.prototype = nearest_model(of.models, height_m);
      const PlantExtent& model = of.models[plant.prototype];
      plant.scale = height_m / model.height_m;
      contenders.push_back({.p_m = glm::dvec2(plant.p_DO),
                            .height_m = height_m,
                            .zone_m = spec.zone * model.crown_radius_m * plant.scale,
                            .tolerance = spec.tolerance,
                            .min_distance_m = spec.min_distance_m,
                            .species = of.layer->scatter.layer,
                            .key = plant.key});
    }
  }
  std::vector<Placement> all;
  for (SpeciesPlants& of : species) {
    all.insert(all.end(), of.plants.begin(), of.plants.end());
    of.plants.clear();
  }
  // Plants are in the order of the species.
  std::size_t of = 0;
  for (const std::size_t i : survivors(contenders)) {
    while (species[of].layer->scatter.layer != contenders[i].species) ++of;
    species[of].plants.push_back(all[i]);
  }
}

}  // namespace groundray
