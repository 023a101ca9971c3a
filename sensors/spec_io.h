#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "sensors/scene_spec.h"

namespace groundray {

/// Reads a scene file (docs/scene.md). Relative paths in it are relative to its folder; a preset's
/// name is looked up in `preset_folder`. The files that a scene names are not opened here, those of
/// lidars and cameras excepted.
/// @throws Error with a line for each fault, in the order of the file: path:line:column, the key,
///         its value, the rule and a likely fix. Faults are unknown, repeated and missing keys,
///         wrong types, values out of range, unknown presets, and whatever is not YAML.
SceneSpec load_scene(const std::filesystem::path& path, const std::filesystem::path& preset_folder);

/// As load_scene, of a text already in memory; `path` stands for the file in messages and in the
/// paths that are relative to it.
SceneSpec parse_scene(const std::string& text, const std::filesystem::path& path,
                      const std::filesystem::path& preset_folder);

/// Reads a lidar preset (docs/sensors.md). @throws Error as load_scene.
LidarSpec load_lidar(const std::filesystem::path& path);

/// As load_lidar, of a text already in memory; `path` stands for the file in messages.
LidarSpec parse_lidar(const std::string& text, const std::filesystem::path& path);

/// Reads a camera preset (docs/sensors.md). @throws Error as load_scene.
CameraSpec load_camera(const std::filesystem::path& path);

/// As load_camera, of a text already in memory; `path` stands for the file in messages, and
/// calibrations that the text names are looked for beside it.
CameraSpec parse_camera(const std::string& text, const std::filesystem::path& path);

/// Returns a lens as the key `lens` of a camera file says it, in one line, to the last bit:
/// "eucm: {focal_px: [460.76, 459.4], ...}".
std::string lens_text(const LensModel& lens);

/// Returns the names of the presets in a folder, sorted. @throws Error if it cannot be read.
std::vector<std::string> preset_names(const std::filesystem::path& preset_folder);

/// What a file of a sensor describes.
enum class SensorKind { Lidar, Camera };

/// As preset_names, of one kind of sensors in a folder of both.
std::vector<std::string> preset_names(const std::filesystem::path& preset_folder, SensorKind kind);

}  // namespace groundray
