#pragma once

#include <fmt/format.h>

#include <glm/vec2.hpp>
#include <string>
#include <string_view>

#include "core/error.h"
#include "terrain/terrain.h"

// Places in scene files and in W, for messages. Not installed.
namespace groundray {

/// Calls `make`, and prepends a place in the scene file and a subject, such as "lidar 'top'", to
/// its errors.
/// @param where  path:line:column; empty if unknown.
template <typename Make>
decltype(auto) located(const std::string& where, std::string_view subject, const Make& make) {
  try {
    return make();
  } catch (const Error& fault) {
    throw Error("{}{}{}: {}", where, where.empty() ? "" : ": ", subject, fault.what());
  }
}

/// Returns true if a point of W is on the DEM's rectangle.
bool is_on_dem(const Terrain& terrain, glm::dvec2 p_W);

/// Returns the extent of the DEM in W and, for a point outside that seems to be in degrees or to
/// have swapped coordinates, that assumption.
std::string dem_extent(const Terrain& terrain, glm::dvec2 p_W);

}  // namespace groundray
