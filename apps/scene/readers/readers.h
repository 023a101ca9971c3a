#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "apps/scene/scene_spec.h"
#include "apps/scene/yaml_reader.h"
#include "sensors/lidar/pattern/scan_pattern.h"

// Readers of the parts of scene, lidar, camera and material files, private to this library. `path`
// is the path of the file that is read; files that it names are relative to its folder.
namespace groundray::yaml {

namespace fs = std::filesystem;

/// Folders of groundray's own data.
struct DataFolders {
  fs::path sensors;
  fs::path materials() const { return sensors.parent_path() / "materials"; }
};

/// Returns the path of a file that is named relative to another file's folder. Names that GDAL can
/// open but that are not paths (/vsizip/..., NETCDF:"...") are returned unchanged.
fs::path beside(const fs::path& file, const std::string& relative);

/// Reads the name of a file that is relative to the folder of `path`.
const Node* read_path(Map& map, std::string_view key, Need need, const fs::path& path,
                      fs::path& into);

/// Reads the classes that labels stand for.
std::map<std::uint16_t, std::string> read_classes(Map& root, Faults& faults);

/// Reads a list of pairs; leaves out those that are invalid, and records them.
std::vector<glm::dvec2> read_points(std::span<const Node> pairs, std::string_view key,
                                    Faults& faults);

/// Records names that an earlier entry of a list already has.
class UniqueNames {
 public:
  UniqueNames(std::string_view what, Faults& faults) : what_(what), faults_(faults) {}
  void add(const Node& entry, const std::string& name) {
    if (!name.empty() && !names_.insert(name).second)
      faults_.add(entry, "name", "'{}' is taken by an earlier {}: names must differ", name, what_);
  }

 private:
  std::string_view what_;
  Faults& faults_;
  std::set<std::string> names_;
};

/// Reads the key `waypoints_m`, at least two points.
/// @param what  has them, for messages.
std::vector<glm::dvec2> read_waypoints(Map& map, std::string_view what, Faults& faults);

/// Reads the list `trails` of a terrain.
std::vector<TrailSpec> read_trails(Map& terrain, Faults& faults);

/// Returns the trail that a key names; null if the key is missing or no trail has the name, which
/// is a fault.
const TrailSpec* find_trail(Map& map, std::string_view key, std::span<const TrailSpec> trails,
                            Faults& faults);

/// Reads the key `sources` of a file: a map of texts, which are not kept.
void check_sources(Map& root, Faults& faults);

/// Reads what an image of the ground is generated of: `generate`, `variant`, `pixels` and `size_m`.
/// Returns nullopt, with faults recorded, if it is invalid.
std::optional<GroundImageSpec> read_ground_image(Map& map, Faults& faults);

/// Reads `texture` of the ground or of a layer of its cover, if it is present.
std::optional<GroundTextureSpec> read_ground_texture(Map& map, const fs::path& path,
                                                     Faults& faults);

/// Reads the map `terrain` of a scene, with the image of its relief.
TerrainSpec read_terrain(Map terrain, const fs::path& path, const DataFolders& folders,
                         Faults& faults);

inline constexpr Rule slope_rule{[](double value) { return value >= 0 && value <= 90; },
                                 "must be from 0 to 90"};

/// Reads [low, high] at a key; leaves `interval` unchanged if the key is missing. Records an empty
/// interval as a fault.
void read_interval(Map& entry, std::string_view key, Interval& interval, Rule rule, Faults& faults);

/// Reads limits [low, high] at `key`, and the width of their ramps at `blend_key`.
CoverLimits read_limits(Map& entry, std::string_view key, std::string_view blend_key, Rule rule,
                        Faults& faults);

/// Reads the conditions `trail`, `water` and `canopy` of a layer.
SiteConditions read_site(Map& entry, std::span<const TrailSpec> trails, Faults& faults);

/// Reads the map `weather` of a scene.
AtmosphereSpec read_air(Map map, Faults& faults);

/// Reads the map `wind` of a scene.
Wind read_wind(Map map);

/// Reads the map `sky` of a scene (docs/theory/sky.md). The image that it names is read for
/// validation only, and not kept.
SkySpec read_sky(Map map, const fs::path& path, Faults& faults);

/// Reads a material that a scene names: a file in data/materials, or a file relative to the scene's
/// folder if the name ends in .yaml. Records a fault and returns nullopt if it cannot be read.
std::optional<Material> read_material(const Node& node, std::string_view key, const fs::path& path,
                                      const DataFolders& folders, Faults& faults);

/// Reads the keys of an entry that give its model and materials.
ModelSpec read_model_spec(Map& entry, const fs::path& path, const DataFolders& folders,
                          Faults& faults);

/// Reads the key `stance`.
void read_stance(Map& entry, Stance& stance);

/// Reads the map `platform` of a scene.
/// @param trails  of the scene, which may be named.
std::variant<RecordedPath, DrivenPath> read_platform(Map platform, const fs::path& path,
                                                     std::span<const TrailSpec> trails,
                                                     Faults& faults);

/// Reads the list `objects` of a scene.
std::vector<ObjectSpec> read_objects(Map& root, const fs::path& path, const DataFolders& folders,
                                     std::span<const TrailSpec> trails, Faults& faults);

/// Reads the lists `scatter` and `ecosystem` of a scene.
/// @param terrain  of the scene, whose trails may be named.
std::vector<ScatterLayer> read_scatter(Map& root, const fs::path& path, const DataFolders& folders,
                                       const TerrainSpec& terrain, Faults& faults);

/// Reads the lists `lidars`, `cameras` and `stereo` of a scene, and the files that they name, into
/// `scene`. Contradictions between the keys of a lidar are not checked here.
void read_sensors(Map& root, const fs::path& path, const fs::path& preset_folder, SceneSpec& scene,
                  Faults& faults);

/// Reads a lidar file.
LidarSpec read_lidar(const Node& node, const fs::path& path, Faults& faults);

/// Applies the keys of a scene's entry that change a lidar.
void change_lidar(Map& entry, const fs::path& path, LidarSpec& lidar, Faults& faults);

/// Reads the pattern of a lidar file: the keys of one kind, by default a spinning head's.
PatternSpec read_pattern(Map& root, const fs::path& path, Faults& faults);

/// Records a fault at `node` unless a turn holds 1 to most_sequences firing sequences.
void check_turn(const Node& node, std::string_view key, const SpinningPattern& pattern,
                Faults& faults);

/// Reads a camera file. Each key is checked by itself; for combinations of keys, see check_rate and
/// complete_camera.
CameraSpec read_camera(const Node& node, const fs::path& path, Faults& faults);

/// Applies the keys of a scene's entry that change a camera.
void change_camera(Map& entry, CameraSpec& camera, Faults& faults);

/// Records at `node` an exposure or readout that takes longer than the period of the images.
/// Applies to a camera without a trigger.
void check_rate(const Node& node, const CameraSpec& camera, Faults& faults);

/// Completes a camera whose keys are valid by themselves: a focal length that is not given becomes
/// that of the lens on its axis. Records contradictions between keys at `node`.
void complete_camera(const Node& node, CameraSpec& camera, Faults& faults);

/// Lens, and the size of its image if it is from a calibration that states it, else 0.
struct CameraFileLens {
  LensModel model;
  glm::ivec2 size_px{0};
};

/// Reads the key `lens` of a camera file: a model with its parameters, or a calibration.
CameraFileLens read_lens(const Node& node, const fs::path& path, Faults& faults);

}  // namespace groundray::yaml
