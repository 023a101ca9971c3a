#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "apps/scene/cover.h"
#include "apps/scene/ecosystem.h"
#include "apps/scene/fingerprint.h"
#include "apps/scene/model_library.h"
#include "apps/scene/scene_place.h"
#include "apps/scene/simulation.h"
#include "apps/scene/sites.h"
#include "core/appearance/ground_cover.h"
#include "core/error.h"
#include "terrain/assets/asset_sway.h"
#include "terrain/assets/fence.h"
#include "terrain/assets/figure.h"
#include "terrain/scatter/scatter.h"
#include "terrain/trail/trails.h"

namespace groundray {
namespace {

constexpr double least_canopy_m = 2;  // height of the lowest plants whose crowns are canopy

// Parts that are collected before they are built.
struct SceneAssembly {
  ModelLibrary library;
  std::vector<PlacedObject> placed;
  std::vector<MovingObject> moving;
  Wind wind;
  std::vector<Sway> sways;  // by model; empty without wind
  std::vector<SceneObjects::Group> standing_groups, moving_groups;
};

constexpr auto is_shaded = [](const auto& layer) { return layer.site.canopy.has_value(); };

bool has_shaded_cover(const SceneSpec& spec) {
  return std::ranges::any_of(spec.terrain.cover, is_shaded);
}

glm::dvec3 to_D(const StandingObject& place, const Terrain& terrain) {
  const glm::dvec3 origin_w_m = terrain.header().origin_w_m;
  const glm::dvec2 p_D = place.at_m - glm::dvec2(origin_w_m);
  if (place.height_m) return {p_D, *place.height_m - origin_w_m.z};
  const auto ground_m = terrain.ground().height_m_at(p_D);
  if (!ground_m) {
    throw Error("there is no ground at ({}, {}) m in W: move at_m, or give height_m; {}",
                place.at_m.x, place.at_m.y,
                is_on_dem(terrain, place.at_m) ? "the DEM has a hole there"
                                               : dem_extent(terrain, place.at_m));
  }
  return {p_D, *ground_m};
}

PlacedObject stand(const StandingObject& place, const Terrain& terrain, double scale,
                   std::uint32_t model) {
  const glm::dvec3 angles_rad =
      glm::radians(glm::dvec3(place.yaw_deg, place.pitch_deg, place.roll_deg));
  PlacedObject object{to_D(place, terrain),
                      rotation_from_yaw_pitch_roll(angles_rad.x, angles_rad.y, angles_rad.z), scale,
                      model};
  if (place.stance == Stance::OnSlope) {
    const auto facet = terrain.ground().facet_at(glm::dvec2(object.p_DO));
    if (!facet) {
      throw Error(
          "there is no ground at ({}, {}) m in W, which stance: on_slope needs: move at_m, or use "
          "upright",
          place.at_m.x, place.at_m.y);
    }
    object.R_DO = tilt_to(terrain.frame().normal(*facet)) * object.R_DO;
  }
  return object;
}

Trajectory lay_object_path(const RecordedPath& path, const SceneSpec& spec, const Terrain& terrain,
                           std::chrono::nanoseconds begin) {
  Trajectory X_DO = recorded_path(path, terrain, begin);
  const std::chrono::nanoseconds end = begin + run_time(spec);
  if (X_DO.end_time() < std::chrono::nanoseconds(0) || run_time(spec) < X_DO.begin_time()) {
    throw Error(
        "{}: it covers {:.3f} s to {:.3f} s, which does not overlap the run, {:.3f} s to {:.3f} s; "
        "are its times on the clock of the platform's trajectory?",
        path.tum.string(), in_seconds(X_DO.begin_time() + begin),
        in_seconds(X_DO.end_time() + begin), in_seconds(begin), in_seconds(end));
  }
  return X_DO;
}

Trajectory lay_object_path(const DrivenPath& path, const SceneSpec& spec, const Terrain& terrain,
                           std::chrono::nanoseconds /*begin*/) {
  return extended(driven_path(path, terrain, run_time(spec)), spec);
}

// Adds a model to the library, and its sway.
std::uint32_t add_to_library(const ModelSpec& model, std::uint16_t label, Palette& palette,
                             SceneAssembly& into) {
  const std::uint32_t number = into.library.add(model, label, palette);
  if (into.wind.speed_m_s == 0) return number;
  const auto* const asset = std::get_if<AssetSpec>(&model.source);
  const Flexibility rest = asset != nullptr ? asset_flexibility(*asset) : Flexibility();
  into.sways.resize(number);  // parts of walkers do not sway
  into.sways.emplace_back(into.wind, model.sway.value_or(rest));
  const auto shines = [](const Material& material) { return material.emitted != glm::dvec3(0); };
  const bool any_shines =
      (model.material && shines(*model.material)) ||
      std::ranges::any_of(model.materials, [&](const auto& each) { return shines(each.second); });
  if (any_shines && !into.sways.back().is_still()) {
    throw Error(
        "its material emits light, but light sources cannot sway in the wind: add sway: "
        "{frequency_hz: 1, lean_deg: 0}");
  }
  return number;
}

// Returns the model of a fence along a line: in D's axes, with its origin at the first post.
ModelSpec fence_along(const ObjectSpec& object, const StandingObject& place,
                      const Terrain& terrain) {
  const auto& fence = std::get<AssetSpec>(object.model.source);
  std::vector<glm::dvec3> posts_m;
  for (const glm::dvec2& at_m : fence_posts(fence, place.line_m)) {
    const glm::dvec2 p_D = at_m - glm::dvec2(terrain.header().origin_w_m);
    const auto ground_m = terrain.ground().height_m_at(p_D);
    if (!ground_m) {
      throw Error(
          "line_m: there is no ground for a post at ({:.3f}, {:.3f}) m in W: move its points; {}",
          at_m.x, at_m.y,
          is_on_dem(terrain, at_m) ? "the DEM has a hole there" : dem_extent(terrain, at_m));
    }
    posts_m.emplace_back(p_D, *ground_m);
  }
  const glm::dvec3 origin = posts_m.front();
  for (glm::dvec3& post : posts_m) post -= origin;
  ModelSpec spec = object.model;
  spec.source = GivenModel{std::make_shared<const Model>(make_fence(fence, posts_m))};
  return spec;
}

// Adds the parts of an asset that walks, as one instance.
void add_walker(const ObjectSpec& object, const AssetSpec& asset, const Trajectory& X_DO,
                const SceneSpec& spec, const Terrain& terrain, Palette& palette,
                SceneAssembly& into) {
  if (object.scale != 1)
    throw Error("scale = {} does not apply to a {} that walks: use size_m", object.scale,
                asset_name(asset.kind));
  std::uint32_t model = into.library.add_parts(object.model, object.label, palette);
  const auto body = static_cast<std::uint32_t>(into.moving_groups.size() + 1);
  constexpr std::chrono::seconds margin(1);  // the last pulses are measured after the run
  const WalkSpec walk_spec{.asset = asset,
                           .origin_w_m = glm::dvec2(terrain.header().origin_w_m),
                           .from = -margin,
                           .until = run_time(spec) + margin};
  const auto ground = [&](const glm::dvec2& p_D) { return terrain.ground().height_m_at(p_D); };
  for (Trajectory& X_DP : walk(ground, walk_spec, X_DO))
    into.moving.push_back({std::move(X_DP), 1, model++, body});
}

void add_object(const ObjectSpec& object, const SceneSpec& spec, const Terrain& terrain,
                std::chrono::nanoseconds begin, Palette& palette, SceneAssembly& into) {
  if (const auto* place = std::get_if<StandingObject>(&object.place)) {
    if (place->line_m.empty()) {
      const std::uint32_t model = add_to_library(object.model, object.label, palette, into);
      into.placed.push_back(stand(*place, terrain, object.scale, model));
    } else {
      const std::uint32_t model =
          add_to_library(fence_along(object, *place, terrain), object.label, palette, into);
      into.placed.push_back(stand({.at_m = place->line_m.front()}, terrain, 1, model));
    }
    into.standing_groups.push_back(
        {object.name, object.label, static_cast<std::uint32_t>(into.placed.size()), 1});
    return;
  }
  const auto* recorded = std::get_if<RecordedPath>(&object.place);
  Trajectory X_DO = recorded != nullptr
                        ? lay_object_path(*recorded, spec, terrain, begin)
                        : lay_object_path(std::get<DrivenPath>(object.place), spec, terrain, begin);
  const auto* asset = std::get_if<AssetSpec>(&object.model.source);
  if (asset != nullptr && figure_parts(asset->kind) > 0) {
    add_walker(object, *asset, X_DO, spec, terrain, palette, into);
  } else {
    const std::uint32_t model = into.library.add(object.model, object.label, palette);
    into.moving.push_back({std::move(X_DO), object.scale, model});
  }
  into.moving_groups.push_back(
      {object.name, object.label, static_cast<std::uint32_t>(into.moving_groups.size() + 1), 1});
}

std::vector<Placement> scattered(const ScatterLayer& layer, const SceneSpec& spec,
                                 const Terrain& terrain, Sites& sites) {
  const glm::dvec3 origin_w_m = terrain.header().origin_w_m;
  ScatterSpec scatter = layer.scatter;
  scatter.origin_w_m = glm::dvec2(origin_w_m);
  scatter.height_m = {scatter.height_m.low - origin_w_m.z, scatter.height_m.high - origin_w_m.z};
  for (Clearing& clearing : scatter.clearings) {
    for (glm::dvec2& point : clearing.points_D) point -= glm::dvec2(origin_w_m);
  }
  for (const ClearedTrail& cleared : layer.trails) {
    const Trail& trail = terrain.relief()->trails()->named(cleared.name);
    scatter.clearings.push_back(
        {.points_D = trail.field().line().points_m, .half_width_m = cleared.half_width_m});
  }
  scatter.suitability = sites.suitability(layer.site);
  const DensityMap density =
      layer.density_map.empty()
          ? DensityMap(layer.density_per_m2)
          : load_density_map(layer.density_map, {layer.density_per_m2, layer.nodata,
                                                 terrain.header().crs_wkt, origin_w_m});
  const Area area{layer.area_W.low_m - scatter.origin_w_m,
                  layer.area_W.high_m - scatter.origin_w_m};
  if ((area & area_of(terrain.frame())).is_empty())
    throw Error("area_m does not overlap the DEM; are its coordinates in the DEM's CRS?");
  return Scatter(terrain.ground(), density, scatter, spec.seed).placements(area);
}

void add_layer(const ScatterLayer& layer, std::span<const Placement> placements,
               std::uint32_t first_model, SceneAssembly& into) {
  const auto first = static_cast<std::uint32_t>(into.placed.size() + 1);
  into.placed.reserve(into.placed.size() + placements.size());
  for (const Placement& placement : placements) {
    into.placed.push_back(
        {placement.p_DO, placement.R_DO, placement.scale, first_model + placement.prototype});
  }
  into.standing_groups.push_back(
      {layer.name, layer.label, first, static_cast<std::uint32_t>(placements.size())});
}

// Storeys of plants: those that depend on the canopy of the others come last.
enum class Storey { Upper, BelowCanopy };

void add_storey(Storey storey, const SceneSpec& spec, const Terrain& terrain, Sites& sites,
                Palette& palette, SceneAssembly& into) {
  std::vector<SpeciesPlants> species;
  std::vector<std::uint32_t> first_models;  // of the species
  for (const ScatterLayer& layer : spec.scatter) {
    if (is_shaded(layer) != (storey == Storey::BelowCanopy)) continue;
    located(layer.where, fmt::format("layer '{}'", layer.name), [&] {
      const std::uint32_t first = into.library.size();
      for (const ModelSpec& model : layer.models) add_to_library(model, layer.label, palette, into);
      std::vector<Placement> placements = scattered(layer, spec, terrain, sites);
      if (!layer.species) return add_layer(layer, placements, first, into);
      std::vector<PlantExtent> models;
      for (std::uint32_t model = first; model < into.library.size(); ++model)
        models.emplace_back(into.library.model(model));
      species.emplace_back(layer, std::move(models), std::move(placements));
      first_models.push_back(first);
    });
  }
  compete(species);
  for (std::size_t i = 0; i < species.size(); ++i)
    add_layer(*species[i].layer, species[i].plants, first_models[i], into);
}

// Returns the crowns of all plants that are placed so far and high enough.
std::vector<Crown> crowns_of(const SceneAssembly& assembly) {
  std::vector<std::optional<PlantExtent>> extents(assembly.library.size());
  std::vector<Crown> crowns;
  for (const PlacedObject& object : assembly.placed) {
    auto& extent = extents[object.model];
    if (!extent) extent.emplace(assembly.library.model(object.model));
    if (extent->height_m * object.scale < least_canopy_m || extent->crown_radius_m == 0) continue;
    crowns.push_back({glm::dvec2(object.p_DO), extent->crown_radius_m * object.scale});
  }
  return crowns;
}

void gather(const SceneSpec& spec, const Terrain& terrain, std::chrono::nanoseconds begin,
            Sites& sites, Palette& palette, SceneAssembly& into) {
  into.wind = spec.wind;
  into.wind.origin_w_m = glm::dvec2(terrain.header().origin_w_m);
  into.wind.variant = spec.seed.value;
  for (const ObjectSpec& object : spec.objects) {
    located(object.where, fmt::format("object '{}'", object.name),
            [&] { add_object(object, spec, terrain, begin, palette, into); });
  }
  add_storey(Storey::Upper, spec, terrain, sites, palette, into);
  if (!has_shaded_cover(spec) && std::ranges::none_of(spec.scatter, is_shaded)) return;
  const std::vector<Crown> crowns = crowns_of(into);
  if (crowns.empty()) {
    throw Error(
        "canopy: no plant with foliage is {} m high or higher, so nothing is below a canopy: add "
        "trees, or remove 'canopy' from the layers",
        least_canopy_m);
  }
  sites.shade(crowns);
  add_storey(Storey::BelowCanopy, spec, terrain, sites, palette, into);
}

std::string fingerprint_of(const SceneAssembly& assembly, std::uint64_t cover) {
  Fingerprint print;
  print.add_all(cover);
  assembly.library.add_to(print);
  for (const auto& [p_DO, R_DO, scale, model] : assembly.placed) {
    print.add_all(p_DO, R_DO, scale, model);
  }
  for (const auto& [X_DO, scale, model, body] : assembly.moving) {
    print.add(std::span(X_DO.samples()));
    print.add_all(scale, model);
    if (body != 0) print.add_all(body);
  }
  print.add(std::span(assembly.sways));
  return fmt::format("{:016x}", print.value());
}

}  // namespace

SceneObjects build_scene_objects(const SceneSpec& spec, const Terrain& terrain,
                                 std::chrono::nanoseconds begin) {
  const RayDevice device;
  Palette palette(spec);
  SceneAssembly assembly{.library = ModelLibrary(device, spec.tracing)};
  const ModelLibrary& library = assembly.library;
  SceneObjects objects;
  Sites sites(spec.terrain, terrain);
  LoadedCover ground;
  if (!has_shaded_cover(spec)) ground = load_cover(spec.terrain, terrain, sites, palette);
  gather(spec, terrain, begin, sites, palette, assembly);
  if (has_shaded_cover(spec)) ground = load_cover(spec.terrain, terrain, sites, palette);
  if (spec.wind.speed_m_s != 0) assembly.sways.resize(library.size());
  objects.fingerprint = fingerprint_of(assembly, ground.fingerprint);
  objects.groups = std::move(assembly.standing_groups);
  for (SceneObjects::Group& group : assembly.moving_groups) {
    group.first += static_cast<std::uint32_t>(assembly.placed.size());
    objects.groups.push_back(std::move(group));
  }
  objects.cover = std::move(ground.cover);
  objects.memory_bytes =
      ground.memory_bytes + library.memory_bytes() + assembly.placed.size() * sizeof(PlacedObject);
  for (const MovingObject& object : assembly.moving)
    objects.memory_bytes += object.X_DO.samples().size() * sizeof(Trajectory::Sample);
  objects.materials = palette.take();
  objects.models = library.truths();
  objects.shapes = library.shapes();
  if (!assembly.placed.empty() || !assembly.moving.empty()) {
    objects.objects = ObjectTracer(device, library.models(), std::move(assembly.placed),
                                   std::move(assembly.moving), std::move(assembly.sways));
  }
  objects.boxes = InstanceBoxes(objects.objects);
  objects.memory_bytes += device.memory_bytes();
  return objects;
}

}  // namespace groundray
