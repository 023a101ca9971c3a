#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <string>
#include <string_view>

#include "reconstruction/mesh/scan/organised_scan.h"

namespace groundray {

/// Properties of a range grid that its file does not contain.
struct RangeGridBeams {
  /// Vector from each point to the origin of its beam: beams are parallel and begin beyond the
  /// scene.
  glm::dvec3 back_m{0, 0, 1};
  float sd_m = 0;  ///< standard deviation of each range
};

/// Reads a PLY with an element `range_grid`, as those of the Stanford 3D Scanning Repository: a
/// list for each cell, row by row, of the vertex that the beam hit or of none, and `obj_info` lines
/// num_cols and num_rows. Frame and unit are those of the file. `returns` are vertex numbers.
/// @throws Error as parse_ply, or naming the file and the rule that the grid violates.
/// @see Turk, Levoy, Zippered polygon meshes from range images (1994), for the acquisition.
OrganisedScan read_range_grid(const std::filesystem::path& path, const RangeGridBeams& beams);

/// Parses a range grid as read_range_grid, from bytes in memory; `name` represents the file in
/// messages.
OrganisedScan parse_range_grid(std::string_view bytes, const std::string& name,
                               const RangeGridBeams& beams);

}  // namespace groundray
