#include <fmt/format.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
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

#include "apps/scene/fingerprint.h"
#include "apps/scene/model_library.h"
#include "apps/scene/scene_place.h"
#include "apps/scene/simulation.h"
#include "core/appearance/ground_cover.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "terrain/dem/drape_io.h"
#include "terrain/scatter/scatter.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

constexpr int points_across = 256;  // side of the lattice for an orthophoto's means

// Loads images, and sums up their memory and fingerprint.
class Images {
 public:
  std::optional<GroundTexture> texture(const std::optional<GroundTextureSpec>& spec) {
    if (!spec) return std::nullopt;
    return GroundTexture{repeating(spec->albedo, Encoding::Srgb),
                         repeating(spec->normal, Encoding::Linear), spec->size_m};
  }
  std::shared_ptr<const Drape> keep(Drape drape) {
    print_.add_all(drape.corner_m, drape.size_m);
    add(drape.image);
    return std::make_shared<const Drape>(std::move(drape));
  }
  std::uint64_t fingerprint() const { return print_.value(); }
  std::size_t memory_bytes() const { return memory_bytes_; }

 private:
  std::shared_ptr<const Texture> repeating(const fs::path& file, Encoding encoding) {
    if (file.empty()) return nullptr;
    auto texture = std::make_shared<const Texture>(read_image8(file), encoding, Wrap::Repeat);
    add(*texture);
    return texture;
  }
  void add(const Texture& texture) {
    memory_bytes_ += texture.memory_bytes();
    const glm::ivec2 size = texture.size();
    print_.add_all(size);
    for (int row = 0; row < size.y; ++row) {
      for (int column = 0; column < size.x; ++column) print_.add_all(texture.texel(0, column, row));
    }
  }

  Fingerprint print_;
  std::size_t memory_bytes_ = 0;
};

CoverLayer load_layer(const CoverSpec& spec, const TerrainSpec& ground, const DemHeader& dem,
                      Palette& palette, Images& images) {
  CoverLayer layer{.material = palette.index_of(spec.material),
                   .label = spec.label.value_or(ground.label),
                   .slope_rad = spec.slope_rad,
                   .height_m = spec.height_m,
                   .mask = nullptr,
                   .texture = images.texture(spec.texture)};
  layer.height_m.low -= dem.origin_w_m.z;
  layer.height_m.high -= dem.origin_w_m.z;
  if (!spec.mask.empty()) {
    layer.mask = images.keep(
        load_mask(spec.mask, {spec.mask_full, spec.mask_nodata, dem.crs_wkt, dem.origin_w_m}));
  }
  return layer;
}

// Returns a lattice of points on the ground under an orthophoto.
std::vector<GroundCover::Point> points_under(const Drape& orthophoto, const Terrain& terrain) {
  const GridFrame& frame = terrain.frame();
  const glm::dvec2 a = frame.origin_m, b = frame.to_D(frame.samples - 1);
  const glm::dvec2 low = glm::max(orthophoto.corner_m, glm::min(a, b));
  const glm::dvec2 high = glm::min(orthophoto.corner_m + orthophoto.size_m, glm::max(a, b));
  if (!(low.x < high.x && low.y < high.y)) {
    throw Error(
        "it does not overlap the DEM: it covers ({:.1f}, {:.1f}) to ({:.1f}, {:.1f}) m from the "
        "DEM's origin; is its CRS correct?",
        orthophoto.corner_m.x, orthophoto.corner_m.y, orthophoto.corner_m.x + orthophoto.size_m.x,
        orthophoto.corner_m.y + orthophoto.size_m.y);
  }
  std::vector<GroundCover::Point> points;
  for (int row = 0; row < points_across; ++row) {
    for (int column = 0; column < points_across; ++column) {
      const glm::dvec2 p_D =
          glm::mix(low, high, (glm::dvec2(column, row) + 0.5) / static_cast<double>(points_across));
      const auto height_m = terrain.ground().height_m_at(p_D);
      const auto facet = terrain.ground().facet_at(p_D);
      if (height_m && facet)
        points.push_back(GroundCover::on_facet({p_D, *height_m}, frame.normal(*facet)));
    }
  }
  return points;
}

// Cover of the ground, with its files loaded.
struct LoadedCover {
  GroundCover cover;              // empty if the ground has a single material without an image
  std::uint64_t fingerprint = 0;  // equal numbers imply equal images
  std::size_t memory_bytes = 0;   // of the images
};

LoadedCover load_cover(const TerrainSpec& spec, const Terrain& terrain, Palette& palette) {
  if (!spec.texture && spec.cover.empty() && spec.orthophoto.empty()) return {};
  const DemHeader& dem = terrain.header();
  Images images;
  std::vector<CoverLayer> layers{{.material = palette.index_of(spec.material),
                                  .label = spec.label,
                                  .mask = nullptr,
                                  .texture = images.texture(spec.texture)}};
  for (std::size_t i = 0; i < spec.cover.size(); ++i) {
    try {
      layers.push_back(load_layer(spec.cover[i], spec, dem, palette, images));
    } catch (const Error& fault) {
      throw Error("cover, layer {}: {}", i + 1, fault.what());
    }
  }
  std::shared_ptr<const Drape> orthophoto;
  std::vector<GroundCover::Point> points;
  if (!spec.orthophoto.empty()) {
    orthophoto = images.keep(load_orthophoto(spec.orthophoto, {dem.crs_wkt, dem.origin_w_m}));
    try {
      points = points_under(*orthophoto, terrain);
    } catch (const Error& fault) {
      throw Error("{}: {}", spec.orthophoto.string(), fault.what());
    }
  }
  return {GroundCover(std::move(layers), std::move(orthophoto), points), images.fingerprint(),
          images.memory_bytes()};
}

// Parts that are collected before they are built.
struct SceneAssembly {
  ModelLibrary library;
  std::vector<PlacedObject> placed;
  std::vector<MovingObject> moving;
  std::vector<SceneObjects::Group> standing_groups, moving_groups;
};

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

void add_object(const ObjectSpec& object, const SceneSpec& spec, const Terrain& terrain,
                std::chrono::nanoseconds begin, std::uint32_t model, SceneAssembly& into) {
  if (const auto* place = std::get_if<StandingObject>(&object.place)) {
    into.placed.push_back(stand(*place, terrain, object.scale, model));
    into.standing_groups.push_back(
        {object.name, object.label, static_cast<std::uint32_t>(into.placed.size()), 1});
    return;
  }
  const auto* recorded = std::get_if<RecordedPath>(&object.place);
  into.moving.push_back({recorded != nullptr ? lay_object_path(*recorded, spec, terrain, begin)
                                             : lay_object_path(std::get<DrivenPath>(object.place),
                                                               spec, terrain, begin),
                         object.scale, model});
  into.moving_groups.push_back(
      {object.name, object.label, static_cast<std::uint32_t>(into.moving.size()), 1});
}

void add_layer(const ScatterLayer& layer, const SceneSpec& spec, const Terrain& terrain,
               std::uint32_t first_model, SceneAssembly& into) {
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

void gather(const SceneSpec& spec, const Terrain& terrain, std::chrono::nanoseconds begin,
            Palette& palette, SceneAssembly& into) {
  ModelLibrary& library = into.library;
  for (const ObjectSpec& object : spec.objects) {
    located(object.where, fmt::format("object '{}'", object.name), [&] {
      add_object(object, spec, terrain, begin, library.add(object.model, object.label, palette),
                 into);
    });
  }
  for (const ScatterLayer& layer : spec.scatter) {
    located(layer.where, fmt::format("layer '{}'", layer.name), [&] {
      const std::uint32_t first = library.size();
      for (const ModelSpec& model : layer.models) library.add(model, layer.label, palette);
      add_layer(layer, spec, terrain, first, into);
    });
  }
}

std::string fingerprint_of(const SceneAssembly& assembly, std::uint64_t cover) {
  Fingerprint print;
  print.add_all(cover);
  assembly.library.add_to(print);
  for (const auto& [p_DO, R_DO, scale, model] : assembly.placed) {
    print.add_all(p_DO, R_DO, scale, model);
  }
  for (const auto& [X_DO, scale, model] : assembly.moving) {
    print.add(std::span(X_DO.samples()));
    print.add_all(scale, model);
  }
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
  LoadedCover ground = load_cover(spec.terrain, terrain, palette);
  gather(spec, terrain, begin, palette, assembly);
  objects.fingerprint = fingerprint_of(assembly, ground.fingerprint);
  objects.groups = std::move(assembly.standing_groups);
  for (SceneObjects::Group& group : assembly.moving_groups) {
    group.first += static_cast<std::uint32_t>(assembly.placed.size());
    objects.groups.push_back(std::move(group));
  }
  objects.cover = std::move(ground.cover);
  objects.memory_bytes =
      ground.memory_bytes + library.memory_bytes() + assembly.placed.size() * sizeof(PlacedObject);
  objects.materials = palette.take();
  objects.models = library.truths();
  objects.shapes = library.shapes();
  if (!assembly.placed.empty() || !assembly.moving.empty()) {
    objects.objects = ObjectTracer(device, library.models(), std::move(assembly.placed),
                                   std::move(assembly.moving));
  }
  objects.memory_bytes += device.memory_bytes();
  return objects;
}

}  // namespace groundray
