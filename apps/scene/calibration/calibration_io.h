#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sensors/lidar/pattern/scan_pattern.h"

// Calibration files that vendors supply with one unit of a lidar. They are read as beams in the
// order of their lasers, channels or rows; docs/theory/lidar_patterns.md describes their contents.
namespace groundray {

/// Largest number of beams in a calibration file: rings have 16 bits.
inline constexpr std::size_t most_beams = 65536;

/// Reads the metadata of an Ouster: JSON of the flat layout (firmware 1 and 2) or the nested one
/// (firmware 3), with beam_altitude_angles, beam_azimuth_angles, lidar_mode,
/// beam_to_lidar_transform or lidar_origin_to_beam_origin_mm, lidar_to_sensor_transform and,
/// optionally, column_window. S is the vendor's sensor frame; rings are rows; all beams of a column
/// fire at once.
/// @throws Error naming file, key, rule and likely fix, for every fault of the file.
SpinningPattern load_ouster_metadata(const std::filesystem::path& path);

/// Reads the lasers of a Velodyne from YAML in the ROS driver's format: a list `lasers` of maps
/// with laser_id, rot_correction and vert_correction in radians, vert_offset_correction and
/// horiz_offset_correction in metres. Rings count up from the lowest laser. Corrections of distance
/// and intensity are ignored. The file contains no firing times; they are 0.
/// @throws Error with path:line:column, key and rule for every fault of the file.
std::vector<Beam> load_velodyne_yaml(const std::filesystem::path& path);

/// Parses a text already in memory like load_ouster_metadata; `path` names the file in messages.
SpinningPattern parse_ouster_metadata(std::string_view text, const std::filesystem::path& path);
/// Parses a text like load_velodyne_yaml.
std::vector<Beam> parse_velodyne_yaml(std::string_view text, const std::filesystem::path& path);
/// Parses the lasers of a Velodyne from the vendor's db.xml, in degrees and centimetres; lasers
/// that `enabled_` switches off are omitted. Otherwise as load_velodyne_yaml.
std::vector<Beam> parse_velodyne_xml(std::string_view text, const std::filesystem::path& path);
/// Parses the channels of a Hesai from an angle correction file: CSV with a line
/// `Channel,Elevation,Azimuth` (or `Laser id` for the channel; in any order), in degrees. Rings are
/// channels minus one. The file contains no firing times; they are 0.
/// @throws Error with path:line and rule for every fault of the file.
std::vector<Beam> parse_hesai_csv(std::string_view text, const std::filesystem::path& path);

/// Returns `pattern` with the angles, origins and rings of `unit`, and its own firing times and
/// loops. Beams are matched by their order in the tables, or by ring if the pattern has loops.
/// @throws Error if the numbers of beams differ, or if a ring of a pattern with loops is missing.
SpinningPattern with_calibration(SpinningPattern pattern, std::span<const Beam> unit);

/// Returns `pattern` adapted to the calibration file of a unit. Its extension determines the
/// format: .xml, .yaml or .yml of a Velodyne and .csv of a Hesai change the beams of a spinning
/// head; .json of an Ouster replaces the pattern.
/// @throws Error as the functions above; for another extension; or if the pattern that is to be
///         changed is not a spinning head.
PatternSpec calibrated(const PatternSpec& pattern, const std::filesystem::path& file);

}  // namespace groundray
