#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sensors/scan_pattern.h"

// The calibration files that vendors ship with one unit, understood as beams in the order of their
// lasers, channels or rows. What each file's figures mean is in docs/lidar_patterns.md.
namespace groundray {

/// Reads the metadata of an Ouster, JSON of the flat layout (firmware 1 and 2) or the nested one
/// (firmware 3): beam_altitude_angles, beam_azimuth_angles, lidar_mode, beam_to_lidar_transform or
/// lidar_origin_to_beam_origin_mm, lidar_to_sensor_transform and the column window. S is the
/// vendor's sensor frame; rings are rows; all beams of a column fire at once.
/// @throws Error naming file, key, rule and likely fix, for every fault of the file.
SpinningPattern load_ouster_metadata(const std::filesystem::path& path);

/// Reads the lasers of a Velodyne from YAML as the ROS driver has it: a list `lasers` of maps with
/// laser_id, rot_correction and vert_correction in radians, vert_offset_correction and
/// horiz_offset_correction in metres. Rings count up from the lowest laser. Corrections of distance
/// and intensity are left aside, and the file tells no firing times: those are 0.
/// @throws Error with path:line:column, key and rule for every fault of the file.
std::vector<Beam> load_velodyne_yaml(const std::filesystem::path& path);

/// Reads the lasers of a Velodyne from the vendor's db.xml, in degrees and centimetres; those that
/// `enabled_` switches off are left out. Otherwise as load_velodyne_yaml.
std::vector<Beam> load_velodyne_xml(const std::filesystem::path& path);

/// Reads the channels of a Hesai from an angle correction file: CSV with a line
/// `Channel,Elevation,Azimuth` (or `Laser id` for the channel; in any order), in degrees. Rings are
/// channels minus one. The file tells no firing times: those are 0.
/// @throws Error with path:line and rule for every fault of the file.
std::vector<Beam> load_hesai_csv(const std::filesystem::path& path);

/// As load_ouster_metadata, of a text already in memory; `path` stands for the file in messages.
SpinningPattern parse_ouster_metadata(std::string_view text, const std::filesystem::path& path);
/// Likewise load_velodyne_yaml.
std::vector<Beam> parse_velodyne_yaml(std::string_view text, const std::filesystem::path& path);
/// Likewise load_velodyne_xml.
std::vector<Beam> parse_velodyne_xml(std::string_view text, const std::filesystem::path& path);
/// Likewise load_hesai_csv.
std::vector<Beam> parse_hesai_csv(std::string_view text, const std::filesystem::path& path);

/// Returns `pattern` with the angles, origins and rings of `unit`, and its own firing times and
/// loops: a preset made into one unit. Beams are matched by their order in the tables, those of a
/// pattern with loops by their rings.
/// @throws Error if the numbers of beams differ.
SpinningPattern with_calibration(SpinningPattern pattern, std::span<const Beam> unit);

/// Returns `pattern` as a unit's file has it, whose kind its extension tells: a Velodyne's .xml,
/// .yaml or .yml and a Hesai's .csv make a preset that unit; an Ouster's .json replaces the
/// pattern.
/// @throws Error as the functions above do.
PatternSpec calibrated(const PatternSpec& pattern, const std::filesystem::path& file);

}  // namespace groundray
