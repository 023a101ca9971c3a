#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <string>
#include <string_view>

#include "reconstruction/scan/organised_scan.h"

namespace groundray {

/// What a range grid does not say of itself.
struct RangeGridBeams {
  /// From each point to where its beam began: beams are parallel, and begin beyond the scene.
  glm::dvec3 back_m{0, 0, 1};
  float sd_m = 0;  ///< standard deviation of each range
};

/// Reads a PLY with an element `range_grid`, as those of the Stanford 3D Scanning Repository: a
/// list for each cell, row by row, of the vertex that the beam met or of none, and `obj_info`
/// lines num_cols and num_rows. Its frame and unit are those of the file. `returns` are vertices.
/// @throws Error as parse_ply, or naming the file and the rule that the grid breaks.
/// @see Turk, Levoy, Zippered polygon meshes from range images (1994): how they came to be.
OrganisedScan read_range_grid(const std::filesystem::path& path, const RangeGridBeams& beams);

/// As read_range_grid, of bytes already in memory; `name` stands for the file in messages.
OrganisedScan parse_range_grid(std::string_view bytes, const std::string& name,
                               const RangeGridBeams& beams);

}  // namespace groundray
