#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/scene/scene_spec.h"

namespace groundray {

/// Reads a scene file (docs/reference/scene.md). Relative paths in it are relative to its folder; a
/// preset's name is looked up in `preset_folder`. Files of sensors, materials, relief and the sky
/// are read here; all other files that the scene names are not opened.
/// @param world  number of one of the worlds of the scene (docs/reference/sampling.md), whose
///               values are drawn; without it the scene is read as written.
/// @throws Error with a line for each fault, in the order of the file: path:line:column, the key,
///         its value, the rule and a likely fix. Faults are unknown, repeated and missing keys,
///         wrong types, values out of range or in contradiction, unknown presets, files that cannot
///         be read, and invalid YAML.
SceneSpec load_scene(const std::filesystem::path& path, const std::filesystem::path& preset_folder,
                     std::optional<std::uint32_t> world = std::nullopt);

/// Parses a text already in memory like load_scene; `path` names the file in messages, and relative
/// paths are relative to its folder.
SceneSpec parse_scene(const std::string& text, const std::filesystem::path& path,
                      const std::filesystem::path& preset_folder,
                      std::optional<std::uint32_t> world = std::nullopt);

/// Reads a lidar preset (docs/reference/sensors.md).
/// @throws Error as load_scene.
LidarSpec load_lidar(const std::filesystem::path& path);

/// Parses a text already in memory like load_lidar; `path` names the file in messages, and files
/// that the text names are relative to its folder.
LidarSpec parse_lidar(const std::string& text, const std::filesystem::path& path);

/// Reads a camera preset (docs/reference/sensors.md).
/// @throws Error as load_scene.
CameraSpec load_camera(const std::filesystem::path& path);

/// Parses a text already in memory like load_camera; `path` names the file in messages, and
/// calibrations that the text names are relative to its folder.
CameraSpec parse_camera(const std::string& text, const std::filesystem::path& path);

/// Reads a material file (docs/reference/materials.md), such as those in data/materials;
/// preset_names lists the names of a folder.
/// @throws Error as load_scene.
Material load_material(const std::filesystem::path& path);

/// Parses a text already in memory like load_material; `path` names the file in messages.
Material parse_material(const std::string& text, const std::filesystem::path& path);

/// Returns a lens in the form of the key `lens` of a camera file, in one line, to the last bit:
/// "eucm: {focal_px: [460.76, 459.4], ...}".
std::string lens_text(const LensModel& lens);

/// Returns the names of the presets in a folder, sorted.
/// @throws Error if the folder cannot be read.
std::vector<std::string> preset_names(const std::filesystem::path& preset_folder);

/// Kind of sensor that a file describes.
enum class SensorKind { Lidar, Camera };

/// Returns the names of the presets of one kind of sensors in a folder of both, sorted.
/// @throws Error if the folder or one of its presets cannot be read.
std::vector<std::string> preset_names(const std::filesystem::path& preset_folder, SensorKind kind);

}  // namespace groundray
