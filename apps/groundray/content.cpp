#include "apps/groundray/content.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <optional>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>
#include <variant>

#include "apps/groundray/cover.h"
#include "apps/groundray/fingerprint.h"
#include "apps/groundray/palette.h"
#include "apps/groundray/paths.h"
#include "core/error.h"
#include "core/product_io.h"
#include "terrain/asset.h"
#include "terrain/scatter.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

// What is gathered before it is built.
struct Gathered {
  std::vector<ModelScene> models;
  std::vector<ModelTruth> truths;
  std::vector<PlacedObject> placed;
  std::vector<MovingObject> moving;
  std::vector<Content::Group> standing_groups, moving_groups;
};

Model load(const std::variant<AssetSpec, ModelSource>& source) {
  if (const auto* asset = std::get_if<AssetSpec>(&source)) return make_asset(*asset);
  const auto& [file, options] = std::get<ModelSource>(source);
  return read_model(file, options).model;
}

// Materials are given to surfaces that are there.
void check_names(const ModelSpec& spec, const Model& model) {
  for (const auto& [name, material] : spec.materials) {
    if (std::ranges::count(model.surfaces, name, &ModelSurface::name) > 0) continue;
    std::vector<std::string_view> names;
    for (const ModelSurface& surface : model.surfaces) names.push_back(surface.name);
    throw Error("materials names the surface '{}', but the model has {}", name,
                fmt::join(names, ", "));
  }
}

// Adds a model; returns its index.
std::uint32_t add_model(const ModelSpec& spec, std::uint16_t label, const RayDevice& device,
                        Tracing tracing, Palette& palette, Gathered& into) {
  Model model = load(spec.source);
  check_names(spec, model);
  ModelTruth truth{label, {}};
  for (const ModelSurface& surface : model.surfaces)
    truth.materials.push_back(palette.index_of(spec, surface.name));
  into.models.emplace_back(device, std::move(model), tracing);
  into.truths.push_back(std::move(truth));
  return static_cast<std::uint32_t>(into.models.size() - 1);
}

glm::dvec3 to_D(const StandingObject& place, const Terrain& terrain) {
  const glm::dvec3 origin_w_m = terrain.header().origin_w_m;
  const glm::dvec2 p_D = place.at_m - glm::dvec2(origin_w_m);
  if (place.height_m) return {p_D, *place.height_m - origin_w_m.z};
  const auto ground_m = terrain.ground().height_m_at(p_D);
  if (!ground_m) {
    throw Error("there is no ground at ({}, {}) m in W to stand on: move at_m, or give height_m",
                place.at_m.x, place.at_m.y);
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
    if (const auto facet = terrain.ground().facet_at(glm::dvec2(object.p_DO)))
      object.R_DO = tilt_to(terrain.frame().normal(*facet)) * object.R_DO;
  }
  return object;
}

void add_object(const ObjectSpec& object, const SceneSpec& spec, const Terrain& terrain,
                std::chrono::nanoseconds begin, std::uint32_t model, Gathered& into) {
  if (const auto* place = std::get_if<StandingObject>(&object.place)) {
    into.placed.push_back(stand(*place, terrain, object.scale, model));
    into.standing_groups.push_back(
        {object.name, object.label, static_cast<std::uint32_t>(into.placed.size()), 1});
    return;
  }
  const auto* recorded = std::get_if<RecordedPath>(&object.place);
  into.moving.push_back({recorded != nullptr ? recorded_path(*recorded, terrain, begin)
                                             : driven_path(std::get<DrivenPath>(object.place),
                                                           terrain, run_time(spec)),
                         object.scale, model});
  into.moving_groups.push_back(
      {object.name, object.label, static_cast<std::uint32_t>(into.moving.size()), 1});
}

void add_layer(const ScatterLayer& layer, const SceneSpec& spec, const Terrain& terrain,
               std::uint32_t first_model, Gathered& into) {
  const glm::dvec3 origin_w_m = terrain.header().origin_w_m;
  ScatterSpec scatter = layer.scatter;
  scatter.origin_w_m = glm::dvec2(origin_w_m);
  scatter.height_m = {scatter.height_m.low - origin_w_m.z, scatter.height_m.high - origin_w_m.z};
  for (Clearing& clearing : scatter.clearings) {
    for (glm::dvec2& point : clearing.points_D) point -= glm::dvec2(origin_w_m);
  }
  const DensityMap density =
      layer.density_map.empty()
          ? DensityMap(layer.density_per_m2)
          : load_density_map(layer.density_map, {layer.density_per_m2, layer.nodata,
                                                 terrain.header().crs_wkt, origin_w_m});
  const auto placements = Scatter(terrain.ground(), density, scatter, spec.seed).placements();
  const auto first = static_cast<std::uint32_t>(into.placed.size() + 1);
  into.placed.reserve(into.placed.size() + placements.size());
  for (const Placement& placement : placements) {
    into.placed.push_back(
        {placement.p_DO, placement.R_DO, placement.scale, first_model + placement.prototype});
  }
  into.standing_groups.push_back(
      {layer.name, layer.label, first, static_cast<std::uint32_t>(placements.size())});
}

// Calls make, and puts the name of the entry that it is about in front of what it throws.
template <typename Make>
void for_entry(std::string_view kind, const std::string& name, const Make& make) {
  try {
    make();
  } catch (const Error& fault) {
    throw Error("{} '{}': {}", kind, name, fault.what());
  }
}

std::string fingerprint_of(const Gathered& gathered, std::uint64_t cover) {
  Fingerprint print;
  print.add_all(cover);
  for (const ModelScene& scene : gathered.models) {
    const Model& model = scene.model();
    print.add(std::span(model.mesh.vertices_m));
    print.add(std::span(model.mesh.triangles));
    print.add(std::span(model.uv));
    print.add(std::span(model.surface_of));
    for (const ModelSurface& surface : model.surfaces) {
      print.add_all(surface.least_alpha);
      for (const ModelImage* image : {&surface.albedo, &surface.opacity}) {
        print.add(image->pixels.values());
        if (!image->file.empty()) print.add(std::span<const char>(read_text(image->file)));
      }
    }
  }
  for (const auto& [p_DO, R_DO, scale, model] : gathered.placed) {
    print.add_all(p_DO, R_DO, scale, model);
  }
  for (const auto& [X_DO, scale, model] : gathered.moving) {
    print.add(std::span(X_DO.samples()));
    print.add_all(scale, model);
  }
  for (const ModelTruth& truth : gathered.truths) print.add(std::span(truth.materials));
  return fmt::format("{:016x}", print.value());
}

}  // namespace

Content build_content(const SceneSpec& spec, const Terrain& terrain,
                      std::chrono::nanoseconds begin) {
  const RayDevice device;
  Palette palette(spec);
  Gathered gathered;
  Content content;
  LoadedCover ground = load_cover(spec.terrain, terrain, palette);
  for (const ObjectSpec& object : spec.objects) {
    for_entry("object", object.name, [&] {
      add_object(object, spec, terrain, begin,
                 add_model(object.model, object.label, device, spec.tracing, palette, gathered),
                 gathered);
    });
  }
  for (const ScatterLayer& layer : spec.scatter) {
    for_entry("layer", layer.name, [&] {
      const auto first = static_cast<std::uint32_t>(gathered.models.size());
      for (const ModelSpec& model : layer.models)
        add_model(model, layer.label, device, spec.tracing, palette, gathered);
      add_layer(layer, spec, terrain, first, gathered);
    });
  }
  content.fingerprint = fingerprint_of(gathered, ground.fingerprint);
  content.groups = std::move(gathered.standing_groups);
  for (Content::Group& group : gathered.moving_groups) {
    group.first += static_cast<std::uint32_t>(gathered.placed.size());
    content.groups.push_back(std::move(group));
  }
  content.cover = std::move(ground.cover);
  content.memory_bytes = ground.memory_bytes + gathered.placed.size() * sizeof(PlacedObject);
  for (const ModelScene& scene : gathered.models) content.memory_bytes += scene.texture_bytes();
  content.materials = palette.take();
  content.models = std::move(gathered.truths);
  if (!gathered.placed.empty() || !gathered.moving.empty()) {
    content.objects = ObjectTracer(device, std::move(gathered.models), std::move(gathered.placed),
                                   std::move(gathered.moving));
  }
  content.memory_bytes += device.memory_bytes();
  return content;
}

}  // namespace groundray
