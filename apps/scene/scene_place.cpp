#include "apps/scene/scene_place.h"

#include <cmath>
#include <glm/common.hpp>

namespace groundray {
namespace {

struct Extent {
  glm::dvec2 low, high;  // in W
};

Extent extent_of(const Terrain& terrain) {
  const GridFrame& frame = terrain.frame();
  const glm::dvec2 origin_w_m(terrain.header().origin_w_m);
  const glm::dvec2 a = frame.to_D({0, 0}), b = frame.to_D(frame.samples - 1);
  return {origin_w_m + glm::min(a, b), origin_w_m + glm::max(a, b)};
}

bool contains(const Extent& extent, glm::dvec2 p) {
  return extent.low.x <= p.x && p.x <= extent.high.x && extent.low.y <= p.y && p.y <= extent.high.y;
}

}  // namespace

bool is_on_dem(const Terrain& terrain, glm::dvec2 p_W) { return contains(extent_of(terrain), p_W); }

std::string dem_extent(const Terrain& terrain, glm::dvec2 p_W) {
  const Extent extent = extent_of(terrain);
  const auto& [low, high] = extent;
  std::string_view guess;
  if (contains(extent, {p_W.y, p_W.x})) {
    guess = "; are easting and northing swapped?";
  } else if (std::abs(p_W.x) <= 180 && std::abs(p_W.y) <= 180 && !contains(extent, p_W)) {
    guess = "; this looks like longitude and latitude in degrees";
  }
  return fmt::format("the DEM covers {:.1f} to {:.1f} east and {:.1f} to {:.1f} north, m in {}{}",
                     low.x, high.x, low.y, high.y, terrain.header().crs_name, guess);
}

}  // namespace groundray
