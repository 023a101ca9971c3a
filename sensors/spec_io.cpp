#include "sensors/spec_io.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/trigonometric.hpp>
#include <glm/vec3.hpp>
#include <set>

#include "sensors/cover_reader.h"
#include "sensors/lidar.h"
#include "sensors/lidar_reader.h"
#include "sensors/material_reader.h"
#include "sensors/object_reader.h"
#include "sensors/pattern_reader.h"
#include "sensors/relief_reader.h"
#include "sensors/sky_reader.h"
#include "sensors/yaml_reader.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using yaml::Faults;
using yaml::Map;
using yaml::Need;
using yaml::Node;
using yaml::not_negative;
using yaml::positive;
using yaml::Rule;

constexpr Rule duration_rule{[](double value) { return value > 0 && value <= 1e6; },
                             "must be > 0 and at most 1e6"};

AtmosphereSpec read_air(Map map, Faults& faults) {
  AtmosphereSpec air;
  map.read_number("visibility_m", Need::Optional, air.visibility_m, positive);
  map.read_choice<HazeLaw>("haze_law", Need::Optional, air.haze_law,
                           {{"kruse", HazeLaw::Kruse}, {"kim", HazeLaw::Kim}});
  map.read_number("fog_range_m", Need::Optional, air.fog_range_m, positive);
  map.read_number("rain_mm_h", Need::Optional, air.rain_mm_h, not_negative);
  map.read_number("backscatter_per_m_sr", Need::Optional, air.backscatter_per_m_sr, not_negative);
  map.read_number("group_index", Need::Optional, air.group_index,
                  Rule{[](double value) { return value >= 1; }, "must be 1 or more"});
  if (std::isfinite(air.visibility_m) && std::isfinite(air.fog_range_m))
    faults.add(map.node(), "weather", "has haze and fog: give one of visibility_m and fog_range_m");
  map.close();
  return air;
}

TerrainSpec read_terrain(Map terrain, const fs::path& path, const DataFolders& folders,
                         Faults& faults) {
  TerrainSpec spec;
  if (const Node* const node = terrain.find("material", Need::Optional))
    spec.material = read_material(*node, "material", path, folders, faults);
  if (auto relief = terrain.map("relief", Need::Optional))
    spec.relief = read_relief(std::move(*relief), path, faults);
  spec.texture = read_ground_texture(terrain, path, faults);
  spec.cover = read_cover(terrain, path, folders, faults);
  std::string orthophoto;
  if (terrain.read_text("orthophoto", Need::Optional, orthophoto))
    spec.orthophoto = beside(path, orthophoto);
  std::string dem;
  if (terrain.read_text("dem", Need::Required, dem)) spec.dem = beside(path, dem);
  double nodata = 0;
  if (terrain.read_number("nodata", Need::Optional, nodata)) spec.options.nodata = nodata;
  terrain.read_text("reproject_to", Need::Optional, spec.options.reproject_to);
  terrain.read_whole("label", Need::Optional, spec.label);
  terrain.read_number("tolerance_m", Need::Optional, spec.detail.tolerance_m, not_negative);
  double tolerance_mrad = 0;
  terrain.read_number("tolerance_mrad", Need::Optional, tolerance_mrad, not_negative);
  spec.detail.tolerance_rad = tolerance_mrad / 1000;
  if (const Node* at = terrain.read_whole("memory_mib", Need::Optional, spec.detail.memory_mib);
      at && spec.detail.memory_mib == 0) {
    faults.add(*at, "memory_mib", "is 0, but must be at least 1");
  }
  terrain.close();
  return spec;
}

std::variant<RecordedPath, DrivenPath> read_platform(Map platform, const fs::path& path,
                                                     Faults& faults) {
  std::variant<RecordedPath, DrivenPath> result;
  std::string tum;
  if (platform.read_text("trajectory", Need::Optional, tum)) {
    result = RecordedPath{beside(path, tum)};
  }
  auto drive = platform.map("drive", Need::Optional);
  const bool recorded = platform.find("trajectory", Need::Optional) != nullptr;
  if (recorded == drive.has_value() && platform.node().kind == Node::Kind::Map) {
    faults.add(platform.node(), "platform", "must have exactly one of 'trajectory' and 'drive'");
  }
  if (drive) result = read_drive(std::move(*drive), faults);
  platform.close();
  return result;
}

Pose read_mount(Map mount) {
  Pose X_BS;
  std::array<double, 3> translation{};
  mount.read_numbers("translation_m", Need::Optional, translation);
  X_BS.translation_m = {translation[0], translation[1], translation[2]};
  glm::dvec3 angles_deg(0);
  mount.read_number("yaw_deg", Need::Optional, angles_deg.x);
  mount.read_number("pitch_deg", Need::Optional, angles_deg.y);
  mount.read_number("roll_deg", Need::Optional, angles_deg.z);
  mount.close();
  const glm::dvec3 angles_rad = glm::radians(angles_deg);
  X_BS.rotation = rotation_from_yaw_pitch_roll(angles_rad.x, angles_rad.y, angles_rad.z);
  return X_BS;
}

// Reads the lidar that a scene's entry names by `preset` or `file`.
void read_source(Map& entry, const fs::path& path, const fs::path& preset_folder,
                 MountedLidar& mounted, Faults& faults) {
  const Node* preset = entry.find("preset", Need::Optional);
  const Node* file = entry.find("file", Need::Optional);
  if (!preset == !file) {
    faults.add(entry.node(), "lidars", "must have exactly one of 'preset' and 'file'");
    return;
  }
  const Node& node = preset ? *preset : *file;
  const std::string_view key = preset ? "preset" : "file";
  if (!yaml::is_text(node, key, faults)) return;
  mounted.source = node.text;
  try {
    const auto names = preset ? preset_names(preset_folder) : std::vector{node.text};
    if (std::ranges::count(names, node.text) == 0) {
      faults.add(node, key, "{} is not in {}{}; it has {}", yaml::shown(node),
                 preset_folder.string(), yaml::suggestion(node.text, names),
                 fmt::join(names, ", "));
      return;
    }
    const fs::path place = preset ? preset_folder / (node.text + ".yaml") : beside(path, node.text);
    mounted.text = yaml::read_file(place);
    mounted.lidar = parse_lidar(mounted.text, place);
  } catch (const Error& fault) {
    faults.add(node, key, "the lidar cannot be read:\n{}", fault.what());
  }
}

bool is_file_name(std::string_view name) {
  return std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  });
}

MountedLidar read_mounted(Map entry, const fs::path& path, const fs::path& preset_folder,
                          Faults& faults) {
  MountedLidar mounted;
  if (const Node* at = entry.read_text("name", Need::Required, mounted.name);
      at && !is_file_name(mounted.name)) {
    faults.add(*at, "name", "is {}, but names files: use letters, digits, '_' and '-' alone",
               yaml::shown(*at));
  }
  read_source(entry, path, preset_folder, mounted, faults);
  if (auto mount = entry.map("mount", Need::Required)) mounted.X_BS = read_mount(std::move(*mount));
  change_lidar(entry, path, mounted.lidar, faults);
  entry.close();
  return mounted;
}

std::vector<MountedLidar> read_lidars(Map& root, const fs::path& path,
                                      const fs::path& preset_folder, Faults& faults) {
  std::vector<MountedLidar> lidars;
  std::set<std::string> names;
  const auto entries = root.list("lidars", Need::Required);
  for (const Node& entry : entries) {
    lidars.push_back(read_mounted(Map(entry, "lidars", faults), path, preset_folder, faults));
    const std::string& name = lidars.back().name;
    if (!name.empty() && !names.insert(name).second) {
      faults.add(entry, "name", "'{}' is taken by an earlier lidar: names must differ", name);
    }
  }
  if (const Node* node = root.find("lidars", Need::Optional);
      node && node->kind == Node::Kind::List && entries.empty()) {
    faults.add(*node, "lidars", "is an empty list, but a scene needs at least one lidar");
  }
  return lidars;
}

// What no key alone can tell: whether the parts of a lidar, the air and the ground go together.
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
                 "the receiver of '{}' needs overlap_m: [from, to], where it begins to see its "
                 "beam: fog sends light back from everywhere",
                 mounted.name);
      continue;
    }
    try {
      const Lidar works(mounted.lidar, scene.air);
      if (light && scene.terrain.material)
        retro_brdf(*scene.terrain.material, light->wavelength_nm);
    } catch (const Error& fault) {
      faults.add(entries[i], "lidars", "'{}' cannot work: {}", mounted.name, fault.what());
    }
  }
  if (has_light && !scene.terrain.material) {
    faults.add(node, "terrain",
               "must name a material, for a lidar has a laser: such as material: dry_soil");
  }
}

// Lidars that do not say how much sunlight there is take the sun of the sky.
void light_by_sky(SceneSpec& scene, std::span<const Node> entries, Faults& faults) {
  if (!scene.sky || !scene.sky->sun) return;
  const Sun sun(*scene.sky->sun, scene.sky->air);
  for (std::size_t i = 0; i < scene.lidars.size(); ++i) {
    auto& light = scene.lidars[i].lidar.light;
    if (!light || light->sun.irradiance_w_m2_nm) continue;
    try {
      light->sun.irradiance_w_m2_nm = solar_irradiance_w_m2_nm(sun, light->wavelength_nm);
      light->sun.direction = sun.direction();
    } catch (const Error& fault) {
      faults.add(entries[i], "lidars", "the sun's light on '{}' is not known: {}; give sun_w_m2_nm",
                 scene.lidars[i].name, fault.what());
    }
  }
}

}  // namespace

SceneSpec load_scene(const fs::path& path, const fs::path& preset_folder) {
  return parse_scene(yaml::read_file(path), path, preset_folder);
}

SceneSpec parse_scene(const std::string& text, const fs::path& path,
                      const fs::path& preset_folder) {
  const Node node = yaml::parse(text, path);
  Faults faults(path);
  SceneSpec scene;
  scene.text = text;
  Map root(node, "", faults);
  const DataFolders folders{preset_folder};
  yaml::check_version(root, "groundray", faults);
  root.read_whole("seed", Need::Required, scene.seed.value);
  root.read_number("duration_s", Need::Required, scene.duration_s, duration_rule);
  root.read_choice<Tracing>("tracing", Need::Optional, scene.tracing,
                            {{"fast", Tracing::Fast}, {"exact", Tracing::Exact}});
  if (auto terrain = root.map("terrain", Need::Required)) {
    scene.terrain = read_terrain(std::move(*terrain), path, folders, faults);
  }
  if (auto platform = root.map("platform", Need::Required)) {
    scene.platform = read_platform(std::move(*platform), path, faults);
  }
  if (auto weather = root.map("weather", Need::Optional))
    scene.air = read_air(std::move(*weather), faults);
  scene.lidars = read_lidars(root, path, preset_folder, faults);
  scene.objects = read_objects(root, path, folders, faults);
  scene.scatter = read_scatter(root, path, folders, faults);
  if (auto sky = root.map("sky", Need::Optional))
    scene.sky = read_sky(std::move(*sky), path, faults);
  const auto entries = root.list("lidars", Need::Optional);
  if (faults.count() == 0) light_by_sky(scene, entries, faults);
  if (faults.count() == 0) check_lidars(scene, node, entries, faults);
  root.close();
  faults.throw_if_any();
  return scene;
}

LidarSpec load_lidar(const fs::path& path) { return parse_lidar(yaml::read_file(path), path); }

LidarSpec parse_lidar(const std::string& text, const fs::path& path) {
  const Node node = yaml::parse(text, path);
  Faults faults(path);
  LidarSpec lidar = read_lidar(node, path, faults);
  faults.throw_if_any();
  return lidar;
}

std::vector<std::string> preset_names(const fs::path& preset_folder) {
  std::vector<std::string> names;
  std::error_code fault;
  for (const fs::directory_entry& entry : fs::directory_iterator(preset_folder, fault)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  if (fault) {
    throw Error("{}: the folder of presets cannot be read: {}", preset_folder.string(),
                fault.message());
  }
  std::ranges::sort(names);
  return names;
}

}  // namespace groundray
