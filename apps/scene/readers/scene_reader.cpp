#include "apps/scene/readers/scene_reader.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include "apps/scene/readers/readers.h"
#include "apps/scene/sampling/world_sampler.h"
#include "apps/scene/yaml_reader.h"
#include "apps/scene/yaml_writer.h"
#include "core/appearance/bsdf.h"
#include "core/folder_names.h"
#include "sensors/lidar/lidar.h"

namespace groundray::yaml {

fs::path beside(const fs::path& file, const std::string& relative) {
  const std::size_t colon = relative.find(':');
  if (relative.starts_with("/vsi") || (colon != std::string::npos && colon < relative.find('/')))
    return relative;
  return (file.parent_path() / relative).lexically_normal();
}

const Node* read_path(Map& map, std::string_view key, Need need, const fs::path& path,
                      fs::path& into) {
  std::string name;
  const Node* const node = map.read_text(key, need, name);
  if (node) into = beside(path, name);
  return node;
}

std::vector<glm::dvec2> read_points(std::span<const Node> pairs, std::string_view key,
                                    Faults& faults) {
  std::vector<glm::dvec2> points;
  for (const Node& pair : pairs) {
    glm::dvec2 point(0);
    if (numbers(pair, key, std::span<double>(&point.x, 2), any_number, faults))
      points.push_back(point);
  }
  return points;
}

void check_sources(Map& root, Faults& faults) {
  const Node* const sources = root.find("sources", Need::Optional);
  if (!sources) return;
  const Map texts(*sources, "sources", faults);
  for (std::size_t i = 1; sources->kind == Node::Kind::Map && i < sources->items.size(); i += 2)
    is_text(sources->items[i], sources->items[i - 1].text, faults);
}

}  // namespace groundray::yaml

namespace groundray {
namespace {

namespace fs = std::filesystem;
using sampling::WorldSampler;
using yaml::Faults;
using yaml::Map;
using yaml::Need;
using yaml::Node;
using yaml::Rule;

constexpr Rule duration_rule{[](double value) { return value > 0 && value <= 1e5; },
                             "must be > 0 and at most 1e5"};

// Checks that lidars, air and ground are compatible.
void check_lidars(const SceneSpec& scene, const Node& node, std::span<const Node> entries,
                  Faults& faults) {
  const bool air_returns =
      scene.air.backscatter_per_m_sr > 0 || std::isfinite(scene.air.fog_range_m);
  bool has_light = false;
  for (std::size_t i = 0; i < scene.lidars.size(); ++i) {
    const MountedLidar& mounted = scene.lidars[i];
    const auto& light = mounted.lidar.light;
    has_light |= light.has_value();
    if (light && air_returns && light->overlap.full_from_m == 0) {
      faults.add(entries[i], "lidars",
                 "the receiver of '{}' needs overlap_m: [from, to], the ranges in which its view "
                 "of the beam becomes complete: fog scatters light back from every range",
                 mounted.name);
      continue;
    }
    try {
      const Lidar works(mounted.lidar, scene.air);
      if (light && scene.terrain.material)
        retro_brdf(*scene.terrain.material, light->wavelength_nm);
    } catch (const Error& fault) {
      faults.add(entries[i], "lidars", "'{}' is invalid: {}", mounted.name, fault.what());
    }
  }
  if (has_light && !scene.terrain.material) {
    faults.add(node, "terrain",
               "must have a material, as a lidar has a laser: for example material: dry_soil");
  }
}

// Returns the ground's materials, from the lowest layer up.
std::vector<const std::optional<Material>*> ground_materials(const TerrainSpec& terrain) {
  std::vector<const std::optional<Material>*> materials{&terrain.material};
  for (const CoverSpec& layer : terrain.cover) materials.push_back(&layer.material);
  return materials;
}

// Checks that the scene has the sky and the materials that its cameras need.
void check_cameras(const SceneSpec& scene, const Node& node, Faults& faults) {
  if (scene.cameras.empty()) return;
  const auto lit = std::ranges::find_if(
      scene.cameras, [](const MountedCamera& mounted) { return needs_light(mounted.camera); });
  if (lit != scene.cameras.end() && !scene.sky) {
    faults.add(node, "sky",
               "missing, but the camera '{}' measures light: add a sky, or choose products without "
               "light, such as products: [truth]",
               lit->name);
  }
  for (const std::optional<Material>* material : ground_materials(scene.terrain)) {
    if (!*material) {
      faults.add(node, "terrain",
                 "must have a material, and so must each layer, for the camera '{}': for example "
                 "material: dry_soil",
                 scene.cameras.front().name);
      continue;
    }
    if ((*material)->emitted != glm::dvec3(0)) {
      faults.add(node, "terrain", "the material '{}' emits light, but only objects can",
                 (*material)->name);
    }
    try {
      bsdf_in_colour(**material);
    } catch (const Error& fault) {
      faults.add(node, "terrain", "the camera '{}' cannot use its material: {}",
                 scene.cameras.front().name, fault.what());
    }
  }
}

// Sets the sunlight of lidars that do not specify it to that of the sky's sun.
void light_by_sky(SceneSpec& scene, std::span<const Node> entries, Faults& faults) {
  if (!scene.sky || !scene.sky->sun) return;
  const Sun sun = sun_of(*scene.sky).value();
  for (std::size_t i = 0; i < scene.lidars.size(); ++i) {
    auto& light = scene.lidars[i].lidar.light;
    if (!light || light->sun.irradiance_w_m2_nm) continue;
    try {
      light->sun.irradiance_w_m2_nm = solar_irradiance_w_m2_nm(sun, light->wavelength_nm);
      light->sun.direction = sun.direction();
    } catch (const Error& fault) {
      faults.add(entries[i], "lidars",
                 "the sunlight on '{}' cannot be computed: {}; give sun_w_m2_nm",
                 scene.lidars[i].name, fault.what());
    }
  }
}

// Rejects a camera file at once, because each of its keys would be unknown to a lidar.
void refuse_camera(const Node& node, const fs::path& path) {
  Faults faults(path);
  const Node* const at = Map(node, "", faults).find("groundray_camera", Need::Optional);
  if (!at) return;
  faults.add(*at, "groundray_camera", "this is a camera, not a lidar: name it under 'cameras'");
  faults.throw_if_any();
}

// Rejects at once a file that is not a scene, because most of its keys would be unknown.
void refuse_others(const Node& node, const fs::path& path) {
  Faults faults(path);
  Map root(node, "", faults);
  if (root.find("groundray", Need::Optional) != nullptr) return;
  for (const auto& [key, kind] :
       {std::pair("groundray_lidar",
                  "a lidar, which a scene names under "
                  "'lidars'"),
        {"groundray_camera", "a camera, which a scene names under 'cameras'"},
        {"groundray_material", "a material"},
        {"groundray_dataset", "the record of a dataset: give its folder"}}) {
    if (const Node* const at = root.find(key, Need::Optional))
      faults.add(*at, key, "this is no scene, but {}", kind);
  }
  faults.throw_if_any();
}

SensorKind kind_of(const fs::path& preset) {
  constexpr std::string_view key = "groundray_camera:";
  const std::string text = yaml::read_file(preset);
  const bool is_camera =
      text.starts_with(key) || text.find("\n" + std::string(key)) != std::string::npos;
  return is_camera ? SensorKind::Camera : SensorKind::Lidar;
}

// Reads what dataset.yaml states of a world.
std::optional<DrawnWorld> read_drawn(Map& root) {
  auto world = root.map("world", Need::Optional);
  if (!world) return std::nullopt;
  DrawnWorld drawn;
  world->read_whole("number", Need::Required, drawn.number);
  if (world->map("drawn", Need::Required))
    drawn.drawn = yaml::line_of(*world->find("drawn", Need::Required));
  world->close();
  return drawn;
}

// Reads all of a scene but its text and its block `worlds`.
SceneSpec read_scene(const Node& node, const fs::path& path, const fs::path& preset_folder,
                     Faults faults) {
  SceneSpec scene;
  Map root(node, "", faults);
  root.find("worlds", Need::Optional);
  scene.world = read_drawn(root);
  scene.classes = yaml::read_classes(root, faults);
  const yaml::DataFolders folders{preset_folder};
  yaml::check_version(root, "groundray", faults);
  root.read_whole("seed", Need::Required, scene.seed.value);
  root.read_number("duration_s", Need::Required, scene.duration_s, duration_rule);
  root.read_choice("tracing", Need::Optional, scene.tracing, {"fast", "exact"});
  if (auto terrain = root.map("terrain", Need::Required)) {
    scene.terrain = read_terrain(std::move(*terrain), path, folders, faults);
  }
  const std::span<const TrailSpec> trails =
      scene.terrain.relief ? std::span<const TrailSpec>(scene.terrain.relief->trails)
                           : std::span<const TrailSpec>();
  if (auto platform = root.map("platform", Need::Required)) {
    scene.platform = read_platform(std::move(*platform), path, trails, faults);
  }
  if (auto weather = root.map("weather", Need::Optional))
    scene.air = read_air(std::move(*weather), faults);
  if (auto wind = root.map("wind", Need::Optional)) scene.wind = read_wind(std::move(*wind));
  read_sensors(root, path, preset_folder, scene, faults);
  scene.objects = read_objects(root, path, folders, trails, faults);
  scene.scatter = read_scatter(root, path, folders, scene.terrain, faults);
  if (auto sky = root.map("sky", Need::Optional))
    scene.sky = read_sky(std::move(*sky), path, faults);
  const auto entries = root.list("lidars", Need::Optional);
  if (faults.count() == 0) light_by_sky(scene, entries, faults);
  if (faults.count() == 0) check_lidars(scene, node, entries, faults);
  if (faults.count() == 0) check_cameras(scene, node, faults);
  root.close();
  faults.throw_if_any();
  return scene;
}

}  // namespace

SceneSpec load_scene(const fs::path& path, const fs::path& preset_folder,
                     std::optional<std::uint32_t> world) {
  return parse_scene(yaml::read_file(path), path, preset_folder, world);
}

SceneSpec parse_scene(const std::string& text, const fs::path& path, const fs::path& preset_folder,
                      std::optional<std::uint32_t> world) {
  const Node node = yaml::parse(text, path);
  refuse_others(node, path);
  Faults faults(path);
  const auto worlds = WorldSampler::read(node, faults);
  if (!world) {
    SceneSpec scene = read_scene(node, path, preset_folder, std::move(faults));
    scene.text = text;
    scene.worlds = worlds ? worlds->count() : 0;
    return scene;
  }
  faults.throw_if_any();
  if (!worlds) {
    throw Error("{}: it has no block `worlds`, so that there is no world {} to choose",
                path.string(), *world);
  }
  const Node drawn = worlds->scene_of(*world);
  try {
    SceneSpec scene = read_scene(drawn, path, preset_folder, std::move(faults));
    scene.text = yaml::text_of(drawn);
    return scene;
  } catch (const Error& fault) {
    throw Error("{}\nin world {}, which `groundray sample --index {}` prints", fault.what(), *world,
                *world);
  }
}

LidarSpec load_lidar(const fs::path& path) { return parse_lidar(yaml::read_file(path), path); }

LidarSpec parse_lidar(const std::string& text, const fs::path& path) {
  const Node node = yaml::parse(text, path);
  Faults faults(path);
  refuse_camera(node, path);
  LidarSpec lidar = read_lidar(node, path, faults);
  faults.throw_if_any();
  return lidar;
}

CameraSpec load_camera(const fs::path& path) { return parse_camera(yaml::read_file(path), path); }

CameraSpec parse_camera(const std::string& text, const fs::path& path) {
  const Node node = yaml::parse(text, path);
  Faults faults(path);
  CameraSpec camera = read_camera(node, path, faults);
  if (faults.count() == 0) check_rate(node, camera, faults);
  if (faults.count() == 0) complete_camera(node, camera, faults);
  faults.throw_if_any();
  return camera;
}

std::vector<std::string> preset_names(const fs::path& preset_folder) {
  std::vector<std::string> names;
  std::error_code fault;
  for (const fs::path name : names_in(preset_folder, fault))
    if (name.extension() == ".yaml") names.push_back(name.stem().string());
  if (fault) {
    throw Error("{}: the folder of presets cannot be read: {}", preset_folder.string(),
                fault.message());
  }
  std::ranges::sort(names);
  return names;
}

std::vector<std::string> preset_names(const fs::path& preset_folder, SensorKind kind) {
  std::vector<std::string> names = preset_names(preset_folder);
  std::erase_if(names, [&](const std::string& name) {
    return kind_of(preset_folder / (name + ".yaml")) != kind;
  });
  return names;
}

}  // namespace groundray
